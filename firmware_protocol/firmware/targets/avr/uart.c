/* USART0: a ring buffer each way, emptied and filled by interrupts. */
#include "drivers.h"
#include "core/hal.h"

#define UBRR ((F_CPU + 4UL * BOARD_BAUD) / (8UL * BOARD_BAUD) - 1UL) /* double speed: 2.1 % fast at 115200; else 3.5 % slow */

typedef char rx_size_is_a_power_of_two[(BOARD_RX_SIZE & (BOARD_RX_SIZE - 1U)) == 0 && BOARD_RX_SIZE <= 256U ? 1 : -1];
typedef char tx_size_fits[BOARD_TX_SIZE <= 255U ? 1 : -1];

static volatile uint8_t rx[BOARD_RX_SIZE], rx_in;
static uint8_t rx_out;
static volatile uint8_t tx[BOARD_TX_SIZE], tx_out;
static volatile uint8_t tx_in;
static uint8_t tx_seen; /* tx_out when the control period began */

void uart_start(void)
{
    UCSR0A = 1U << U2X0; /* before the divider */
    UBRR0H = (uint8_t)(UBRR >> 8);
    UBRR0L = (uint8_t)UBRR;
    UCSR0C = 3U << UCSZ00;
    UCSR0B = 1U << RXCIE0 | 1U << RXEN0 | 1U << TXEN0;
}

/* A byte without a stop bit is noise. What finds no room is lost; the checksum of its frame will tell. */
ISR(USART_RX_vect)
{
    uint8_t status = UCSR0A;
    uint8_t byte = UDR0;
    uint8_t next = (uint8_t)((rx_in + 1U) % BOARD_RX_SIZE);

    if (!(status & (1U << FE0)) && next != rx_out) {
        rx[rx_in] = byte;
        rx_in = next;
    }
}

ISR(USART_UDRE_vect)
{
    uint8_t next = tx_out;

    if (next == tx_in) {
        UCSR0B &= (uint8_t) ~(1U << UDRIE0);
        return;
    }
    UDR0 = tx[next];
    next++;
    tx_out = next == BOARD_TX_SIZE ? 0 : next;
}

void uart_begin(void)
{
    tx_seen = tx_out;
}

int16_t hal_read(void *board)
{
    uint8_t byte, out = rx_out;

    (void)board;
    if (out == rx_in) {
        return -1;
    }
    byte = rx[out];
    rx_out = (uint8_t)((out + 1U) % BOARD_RX_SIZE);
    return byte;
}

/* The room at the beginning of the control period, less what has been written since: what is sent in it does not hang on how
 * long the work takes. */
uint16_t hal_write_room(void *board)
{
    uint8_t in = tx_in, out = tx_seen;

    (void)board;
    return in >= out ? (uint8_t)(BOARD_TX_SIZE - 1U - (uint8_t)(in - out)) : (uint8_t)(out - in - 1U);
}

void hal_write(void *board, const uint8_t *data, uint8_t length)
{
    uint8_t in = tx_in;

    (void)board;
    while (length-- > 0) {
        tx[in] = *data++;
        in++;
        if (in == BOARD_TX_SIZE) {
            in = 0;
        }
    }
    tx_in = in;
    cli(); /* the interrupt handler changes this register, too */
    UCSR0B |= 1U << UDRIE0;
    sei();
}
