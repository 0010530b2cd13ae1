/* SPDX-License-Identifier: Apache-2.0
 *
 * Second stage of booting. The boot ROM copies the first 256 bytes of flash to RAM, checks their CRC-32 (the
 * image writer appends it) and calls them. Sets the flash interface to quad reads that continue without a
 * command (EBh with mode bits A0h): 20 clocks a word instead of 64. Then starts the program; or returns to a
 * caller that came with a return address (flash.cpp, after writing: the ROM has left this mode and has put the
 * pads back, so this sets up both again).
 *
 * Quad reads need the chip's QE bit. If it is not set, this sets it, once for ever (W25Q16JV data sheet,
 * 7.1.4). If the chip does not take it, reads stay serial (03h), which every SPI NOR chip knows.
 */
        .syntax unified
        .cpu    cortex-m0plus
        .thumb
        .section .boot2, "ax"

        /* SSI at 0x18000000, RP2040 data sheet 4.10.13 */
        .equ    CTRLR0, 0x00
        .equ    CTRLR1, 0x04
        .equ    SSIENR, 0x08
        .equ    BAUDR, 0x14
        .equ    SR, 0x28
        .equ    DR0, 0x60
        .equ    RX_SAMPLE_DLY, 0xf0
        .equ    SPI_CTRLR0, 0xf4
        /* PADS_QSPI, 2.19.6.4 */
        .equ    SCLK, 0x04
        .equ    SD0, 0x08
        .equ    VECTORS, 0x10000100
        .equ    VTOR, 0xe000ed08

        .equ    FRAME_8, 7 << 16
        .equ    FRAME_32, 31 << 16
        .equ    EEPROM_READ, 3 << 8
        .equ    QUAD, 2 << 21
        .equ    ADDRESS_AND_MODE, 8 << 2        /* 32 bits */
        .equ    WAIT_4, 4 << 11
        .equ    COMMAND_8, 2 << 8

        .global boot2
        .thumb_func
boot2:  push    {r4, r5, r6, r7, lr}
        /* Pads: a fast, strong clock; no hysteresis, which delays the data. */
        ldr     r3, =0x40020000
        movs    r0, #0x21
        str     r0, [r3, #SCLK]
        ldr     r0, [r3, #SD0]
        movs    r1, #2
        bics    r0, r1
        str     r0, [r3, #SD0]
        str     r0, [r3, #SD0 + 4]
        str     r0, [r3, #SD0 + 8]
        str     r0, [r3, #SD0 + 12]
        movs    r3, #0x18
        lsls    r3, r3, #24                     /* SSI from here on */
        movs    r4, #2                          /* clock: half of the system's */
        movs    r6, #RX_SAMPLE_DLY
        adds    r6, r6, r3
        bl      finish
        bl      quad_is_enabled
        beq     quad
        movs    r0, #0x06                       /* write enable */
        str     r0, [r3, #DR0]
        bl      finish
        movs    r0, #0x01                       /* write status: 0, QE */
        movs    r1, #0
        movs    r2, #2
        str     r0, [r3, #DR0]
        str     r1, [r3, #DR0]
        str     r2, [r3, #DR0]
        bl      finish
1:      movs    r0, #0x05
        bl      read_status
        lsrs    r0, r0, #1
        bcs     1b                              /* busy */
        bl      quad_is_enabled
        beq     quad
        movs    r4, #4                          /* 03h is slow: at most 50 MHz */
        ldr     r0, =FRAME_32 | EEPROM_READ
        ldr     r2, =(0x03 << 24) | COMMAND_8 | (6 << 2)
        b       last
quad:   ldr     r0, =QUAD | FRAME_32 | EEPROM_READ
        ldr     r2, =ADDRESS_AND_MODE | WAIT_4 | COMMAND_8 | 1
        bl      set_up
        movs    r1, #0xeb                       /* one read with its command: from now on none is needed */
        str     r1, [r3, #DR0]
        movs    r1, #0xa0
        str     r1, [r3, #DR0]
        bl      wait
        ldr     r2, =(0xa0 << 24) | ADDRESS_AND_MODE | WAIT_4 | 2
last:   bl      set_up
        pop     {r4, r5, r6, r7}
        pop     {r0}
        cmp     r0, #0
        beq     1f
        bx      r0
1:      ldr     r0, =VECTORS
        ldr     r1, =VTOR
        str     r0, [r1]
        ldmia   r0, {r0, r1}
        msr     msp, r0
        bx      r1

        /* Waits for the end of a command, forgets its answers, and is ready for plain commands of bytes. */
finish: mov     r5, lr
        bl      wait
        mov     lr, r5
        movs    r0, #FRAME_8 >> 16
        lsls    r0, r0, #16

        /* The interface with CTRLR0 = r0 and SPI_CTRLR0 = r2, clock divider r4. */
set_up: movs    r1, #0
        str     r1, [r3, #SSIENR]
        str     r0, [r3, #CTRLR0]
        str     r1, [r3, #CTRLR1]
        str     r4, [r3, #BAUDR]
        movs    r1, #1
        str     r1, [r6]                        /* sample a clock later */
        str     r2, [r6, #SPI_CTRLR0 - RX_SAMPLE_DLY]
        str     r1, [r3, #SSIENR]
        bx      lr

        /* Flags: eq if QE is set. */
quad_is_enabled:
        mov     r7, lr
        movs    r0, #0x35
        bl      read_status
        movs    r1, #2
        bics    r1, r0
        bx      r7

        /* Command r0 and its answer, in r0. */
read_status:
        mov     r5, lr
        str     r0, [r3, #DR0]
        str     r0, [r3, #DR0]
        bl      wait
        ldr     r0, [r3, #DR0]
        ldr     r0, [r3, #DR0]
        bx      r5

wait:   ldr     r1, [r3, #SR]
        lsrs    r1, r1, #1                      /* busy */
        bcs     wait
        lsrs    r1, r1, #2                      /* all sent */
        bcc     wait
        bx      lr
        .ltorg
