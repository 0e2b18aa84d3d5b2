/* At every reset, before memory is initialised: nothing is on the stack yet.
 *
 * A watchdog that has bitten goes on running, at its shortest: it is stopped. Then all RAM from the end of the variables on
 * is painted, so that later one can see how deep the stack has been.
 */
#include <avr/io.h>

#include "board.h"

        .section .init3, "ax", @progbits
        .global board_startup
board_startup:
        out     _SFR_IO_ADDR(MCUSR), r1 /* r1 is zero; a watchdog can't be stopped while its flag is set */
        wdr
        ldi     r24, (1 << WDCE) | (1 << WDE)
        sts     WDTCSR, r24
        sts     WDTCSR, r1
        ldi     r30, lo8(_end)
        ldi     r31, hi8(_end)
        ldi     r24, BOARD_STACK_PAINT
        ldi     r25, hi8(RAMEND + 1)
1:      st      Z+, r24
        cpi     r30, lo8(RAMEND + 1)
        cpc     r31, r25
        brne    1b
