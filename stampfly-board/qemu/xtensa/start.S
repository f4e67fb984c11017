/* Start-up of QEMU's Xtensa board sim: register windows, FPU, stack, and the emulator's calls. */

/* Window overflow and underflow, as the architecture prescribes them: 4, 8 and 12 registers. */
    .section .vectors, "ax"
    .global _vectors
_vectors:
    .org 0x000
    s32e a0, a5, -16
    s32e a1, a5, -12
    s32e a2, a5, -8
    s32e a3, a5, -4
    rfwo
    .org 0x040
    l32e a0, a5, -16
    l32e a1, a5, -12
    l32e a2, a5, -8
    l32e a3, a5, -4
    rfwu
    .org 0x080
    s32e a0, a9, -16
    l32e a0, a1, -12
    s32e a1, a9, -12
    s32e a2, a9, -8
    s32e a3, a9, -4
    s32e a4, a0, -32
    s32e a5, a0, -28
    s32e a6, a0, -24
    s32e a7, a0, -20
    rfwo
    .org 0x0c0
    l32e a0, a9, -16
    l32e a1, a9, -12
    l32e a2, a9, -8
    l32e a7, a1, -12
    l32e a3, a9, -4
    l32e a4, a7, -32
    l32e a5, a7, -28
    l32e a6, a7, -24
    l32e a7, a7, -20
    rfwu
    .org 0x100
    s32e a0, a13, -16
    l32e a0, a1, -12
    s32e a1, a13, -12
    s32e a2, a13, -8
    s32e a3, a13, -4
    s32e a4, a0, -48
    s32e a5, a0, -44
    s32e a6, a0, -40
    s32e a7, a0, -36
    s32e a8, a0, -32
    s32e a9, a0, -28
    s32e a10, a0, -24
    s32e a11, a0, -20
    rfwo
    .org 0x140
    l32e a0, a13, -16
    l32e a1, a13, -12
    l32e a2, a13, -8
    l32e a11, a1, -12
    l32e a3, a13, -4
    l32e a4, a11, -48
    l32e a5, a11, -44
    l32e a6, a11, -40
    l32e a7, a11, -36
    l32e a8, a11, -32
    l32e a9, a11, -28
    l32e a10, a11, -24
    l32e a11, a11, -20
    rfwu
/* Every other exception ends the run with code 99. The bytes are `simcall`, which the assembler does not know. */
    .org 0x180
    .rept 10
    movi a2, 1
    movi a3, 99
    .byte 0x00, 0x51, 0x00
    .p2align 6
    .endr

    .section .start, "ax"
    .p2align 2
.Lstack: .long _stack_top
.Lmain:  .long main
.Lps:    .long 0x0004000f
.Lvec:   .long _vectors
    .global _start
_start:
    movi a0, 0
    movi a2, 0
    wsr a2, windowbase
    rsync
    movi a2, 1
    wsr a2, windowstart
    rsync
    l32r a1, .Lstack
    l32r a2, .Lvec
    wsr a2, vecbase
    movi a2, 1
    wsr a2, cpenable
/* Comparing and exchanging (s32c1i) is the core's own work wherever it is: the board's memory is one that no cache is in front of. */
    movi a2, 0x2a
    wsr a2, atomctl
    l32r a2, .Lps
    wsr a2, ps
    rsync
    l32r a4, .Lmain
    callx8 a4

    .section .reset, "ax"
    .p2align 2
    j 1f
    .p2align 2
.Lgo: .long _start
1:  l32r a2, .Lgo
    jx a2

/* usize simcall(number, a, b, c): a service of the emulator. */
    .section .text.simcall, "ax"
    .p2align 2
    .global simcall
simcall:
    entry a1, 32
    .byte 0x00, 0x51, 0x00
    retw

/* u32 cycle_count(): the core's counter. */
    .section .text.cycle_count, "ax"
    .p2align 2
    .global cycle_count
cycle_count:
    entry a1, 32
    rsr a2, ccount
    retw
