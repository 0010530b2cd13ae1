// SPDX-License-Identifier: Apache-2.0
// Second stage: reads by the plain 03h command, which every serial flash knows, then goes through the vector table at 0x10000100.
// The CRC over its 252 bytes is written by make_uf2.mjs.
.syntax unified
.cpu cortex-m0plus
.thumb
.section .stage, "ax"
  ldr r3, =0x18000000          // SSI
  movs r1, #0
  str r1, [r3, #0x08]          // off while it is set up
  movs r1, #4
  str r1, [r3, #0x14]          // clk_sys / 4
  ldr r1, =(31 << 16) | (3 << 8)
  str r1, [r3, #0x00]          // 32-bit frames, EEPROM read
  ldr r1, =(0x03 << 24) | (2 << 8) | (6 << 2)
  movs r0, #0xf4
  str r1, [r3, r0]             // command 03h, 24-bit address
  movs r1, #0
  str r1, [r3, #0x04]
  movs r1, #1
  str r1, [r3, #0x08]
  ldr r0, =0x10000100
  ldr r1, =0xe000ed08          // VTOR
  str r0, [r1]
  ldmia r0!, {r1, r2}
  msr msp, r1
  bx r2
.ltorg
