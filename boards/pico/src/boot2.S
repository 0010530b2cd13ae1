/* SPDX-License-Identifier: Apache-2.0
 *
 * Second stage of booting. The boot ROM copies the first 256 bytes of flash to RAM, checks their CRC-32 (the
 * image writer appends it) and calls them. Sets the flash interface to plain serial reads (command 03h), which
 * every SPI NOR chip knows, then starts the program; or returns to a caller that came with a return address
 * (flash.cpp, after writing).
 */
        .syntax unified
        .cpu    cortex-m0plus
        .thumb
        .section .boot2, "ax"

        .equ    SSI, 0x18000000
        .equ    CTRLR0, 0x00
        .equ    CTRLR1, 0x04
        .equ    SSIENR, 0x08
        .equ    BAUDR, 0x14
        .equ    SPI_CTRLR0, 0xf4
        .equ    VECTORS, 0x10000100
        .equ    VTOR, 0xe000ed08

        .global boot2
        .thumb_func
boot2:  push    {lr}
        ldr     r3, =SSI
        movs    r1, #0
        str     r1, [r3, #SSIENR]       /* off while it is set up */
        movs    r1, #4
        str     r1, [r3, #BAUDR]        /* 125 MHz / 4 */
        ldr     r1, =(31 << 16) | (3 << 8)
        str     r1, [r3, #CTRLR0]       /* 32 bits a frame, EEPROM read */
        movs    r0, #SPI_CTRLR0
        adds    r0, r0, r3
        ldr     r1, =(0x03 << 24) | (2 << 8) | (6 << 2)
        str     r1, [r0]                /* command 03h, 8 bits of command, 24 of address */
        movs    r1, #0
        str     r1, [r3, #CTRLR1]
        movs    r1, #1
        str     r1, [r3, #SSIENR]
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
        .ltorg
