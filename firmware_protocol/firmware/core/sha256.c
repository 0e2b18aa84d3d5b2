/* SHA-256 (FIPS 180-4), written for small machines: no table in working memory, no copy of the message schedule.
 *
 * What mavgen generates keeps its 256 bytes of constants in working memory on an AVR, and rotates by shifting 32 times.
 */
#include "core/core.h"

#if FIRMWARE_SIGNING

static const uint32_t rounds[64] HAL_FLASH = {
    0x428a2f98UL, 0x71374491UL, 0xb5c0fbcfUL, 0xe9b5dba5UL, 0x3956c25bUL, 0x59f111f1UL, 0x923f82a4UL, 0xab1c5ed5UL,
    0xd807aa98UL, 0x12835b01UL, 0x243185beUL, 0x550c7dc3UL, 0x72be5d74UL, 0x80deb1feUL, 0x9bdc06a7UL, 0xc19bf174UL,
    0xe49b69c1UL, 0xefbe4786UL, 0x0fc19dc6UL, 0x240ca1ccUL, 0x2de92c6fUL, 0x4a7484aaUL, 0x5cb0a9dcUL, 0x76f988daUL,
    0x983e5152UL, 0xa831c66dUL, 0xb00327c8UL, 0xbf597fc7UL, 0xc6e00bf3UL, 0xd5a79147UL, 0x06ca6351UL, 0x14292967UL,
    0x27b70a85UL, 0x2e1b2138UL, 0x4d2c6dfcUL, 0x53380d13UL, 0x650a7354UL, 0x766a0abbUL, 0x81c2c92eUL, 0x92722c85UL,
    0xa2bfe8a1UL, 0xa81a664bUL, 0xc24b8b70UL, 0xc76c51a3UL, 0xd192e819UL, 0xd6990624UL, 0xf40e3585UL, 0x106aa070UL,
    0x19a4c116UL, 0x1e376c08UL, 0x2748774cUL, 0x34b0bcb5UL, 0x391c0cb3UL, 0x4ed8aa4aUL, 0x5b9cca4fUL, 0x682e6ff3UL,
    0x748f82eeUL, 0x78a5636fUL, 0x84c87814UL, 0x8cc70208UL, 0x90befffaUL, 0xa4506cebUL, 0xbef9a3f7UL, 0xc67178f2UL,
};

static const uint32_t initial[8] HAL_FLASH = {
    0x6a09e667UL, 0xbb67ae85UL, 0x3c6ef372UL, 0xa54ff53aUL, 0x510e527fUL, 0x9b05688cUL, 0x1f83d9abUL, 0x5be0cd19UL,
};

/* Bytes first, which an 8-bit machine does by moving them, then bits. */
static uint32_t rotated(uint32_t x, uint8_t right)
{
    if (right & 16) {
        x = x >> 16 | x << 16;
    }
    if (right & 8) {
        x = x >> 8 | x << 24;
    }
    for (right &= 7; right > 0; right--) {
        x = x >> 1 | x << 31;
    }
    return x;
}

static void compress(struct sha256 *hash)
{
    uint32_t v[8];
    uint8_t i;

    memcpy(v, hash->state, sizeof v);
    for (i = 0; i < 64; i++) {
        uint32_t *word = &hash->block[i & 15];
        uint32_t sum, x;

        if (i >= 16) {
            x = hash->block[(i - 15) & 15];
            sum = rotated(x, 7) ^ rotated(x, 18) ^ (rotated(x, 3) & 0x1FFFFFFFUL);
            x = hash->block[(i - 2) & 15];
            sum += rotated(x, 17) ^ rotated(x, 19) ^ (rotated(x, 10) & 0x003FFFFFUL);
            *word += sum + hash->block[(i - 7) & 15];
        }
        x = v[4];
        sum = v[7] + *word + flash_u32(&rounds[i]) + ((x & v[5]) ^ (~x & v[6]));
        sum += rotated(rotated(rotated(x, 14) ^ x, 5) ^ x, 6); /* by 6, 11 and 25 */
        memmove(v + 1, v, 7 * sizeof v[0]);
        v[4] += sum;
        x = v[1];
        sum += (x & v[2]) ^ (x & v[3]) ^ (v[2] & v[3]);
        v[0] = sum + rotated(rotated(rotated(x, 9) ^ x, 11) ^ x, 2); /* by 2, 13 and 22 */
    }
    for (i = 0; i < 8; i++) {
        hash->state[i] += v[i];
    }
}

void sha256_begin(struct sha256 *hash)
{
    flash_copy(hash->state, initial, sizeof initial);
    hash->length = 0;
}

void sha256_add(struct sha256 *hash, uint8_t byte)
{
    uint32_t *word = &hash->block[hash->length / 4 % 16];

    *word = *word << 8 | byte;
    if (++hash->length % 64 == 0) {
        compress(hash);
    }
}

/* The first bytes of the hash. */
void sha256_end(struct sha256 *hash, uint8_t *first, uint8_t count)
{
    uint32_t bits = (uint32_t)hash->length * 8;
    uint8_t i;

    sha256_add(hash, 0x80);
    while (hash->length % 64 != 56) {
        sha256_add(hash, 0);
    }
    for (i = 0; i < 8; i++) { /* no length of ours needs more than 32 bits */
        sha256_add(hash, i < 4 ? 0 : (uint8_t)(bits >> (56 - 8 * i)));
    }
    for (i = 0; i < count; i++) {
        first[i] = (uint8_t)(hash->state[i / 4] >> (24 - 8 * (i % 4)));
    }
}

#else
typedef int sha256_is_not_compiled_in; /* C99 has no empty file */
#endif
