/* Frames of the HapDef wire protocol, version 1: see ../PROTOCOL.md.
 *
 * Plain C without allocation: it goes into a sketch as it is, and is compiled and tested on a host against
 * the vectors of the specification.
 */
#ifndef HAPD_FRAME_H
#define HAPD_FRAME_H

#include <stddef.h>
#include <stdint.h>
#include <string.h>

enum {
  HAPD_VERSION = 1,
  HAPD_LONGEST = 253, /* a frame before COBS */
  HAPD_WIRE = HAPD_LONGEST + 2,
  HAPD_HELLO = 0x01,
  HAPD_DATA = 0x02,
  HAPD_STATUS = 0x03,
  HAPD_LOG = 0x04,
  HAPD_PONG = 0x05,
  HAPD_ASK_HELLO = 0x81,
  HAPD_START = 0x82,
  HAPD_STOP = 0x83,
  HAPD_RATE = 0x84,
  HAPD_PING = 0x85
};

/* A frame being put together. */
typedef struct {
  uint8_t bytes[HAPD_LONGEST];
  size_t length;
} hapd_frame;

/* CRC-16/IBM-3740. */
static inline uint16_t hapd_crc(const uint8_t *bytes, size_t length) {
  uint16_t crc = 0xFFFF;
  for (size_t i = 0; i < length; i++) {
    crc ^= (uint16_t)((uint16_t)bytes[i] << 8);
    for (int k = 0; k < 8; k++) {
      crc = (uint16_t)((crc & 0x8000) ? (crc << 1) ^ 0x1021 : crc << 1);
    }
  }
  return crc;
}

static inline void hapd_put(hapd_frame *frame, uint32_t value, int bytes) {
  /* Room is kept for the sum. */
  for (int k = 0; k < bytes && frame->length < HAPD_LONGEST - 2; k++) {
    frame->bytes[frame->length++] = (uint8_t)(value >> (8 * k));
  }
}

static inline void hapd_begin(hapd_frame *frame, uint8_t type, uint16_t sequence, uint32_t time_us) {
  frame->length = 0;
  hapd_put(frame, type, 1);
  hapd_put(frame, sequence, 2);
  hapd_put(frame, time_us, 4);
}

static inline void hapd_put_text(hapd_frame *frame, const char *text) {
  for (; *text; text++) {
    hapd_put(frame, (uint8_t)*text, 1);
  }
}

/* Counts one behind the other, the lowest bits first. */
static inline void hapd_put_counts(hapd_frame *frame, const uint32_t *counts, int channels, int bits) {
  uint64_t held = 0;
  int filled = 0;
  for (int k = 0; k < channels; k++) {
    held |= (uint64_t)(counts[k] & ((1UL << bits) - 1)) << filled;
    for (filled += bits; filled >= 8; filled -= 8, held >>= 8) {
      hapd_put(frame, (uint8_t)held, 1);
    }
  }
  if (filled > 0) {
    hapd_put(frame, (uint8_t)held, 1);
  }
}

/* What a board says of itself. */
static inline void hapd_put_hello(hapd_frame *frame, uint32_t board, uint8_t channels, uint8_t bits,
                                  uint16_t reference_mv, uint16_t supply_mv, uint32_t gain_milli,
                                  uint16_t rate_hz, const char *name) {
  hapd_put_text(frame, "HAPD");
  hapd_put(frame, HAPD_VERSION, 1);
  hapd_put(frame, board, 4);
  hapd_put(frame, channels, 1);
  hapd_put(frame, bits, 1);
  hapd_put(frame, reference_mv, 2);
  hapd_put(frame, supply_mv, 2);
  hapd_put(frame, gain_milli, 4);
  hapd_put(frame, rate_hz, 2);
  hapd_put_text(frame, name);
}

/* Ends a frame: its bytes on the wire, the zero included, go to `wire` (HAPD_WIRE bytes); how many. */
static inline size_t hapd_end(hapd_frame *frame, uint8_t *wire) {
  uint16_t crc = hapd_crc(frame->bytes, frame->length);
  frame->bytes[frame->length++] = (uint8_t)crc;
  frame->bytes[frame->length++] = (uint8_t)(crc >> 8);
  size_t code = 0, out = 1;
  for (size_t i = 0; i < frame->length; i++) {
    if (frame->bytes[i]) {
      wire[out++] = frame->bytes[i];
    } else {
      wire[code] = (uint8_t)(out - code);
      code = out++;
    }
  }
  wire[code] = (uint8_t)(out - code);
  wire[out++] = 0;
  return out;
}

/* Bytes that come in, until a zero ends them. */
typedef struct {
  uint8_t bytes[HAPD_WIRE];
  size_t length;
  uint8_t overlong;
} hapd_inbox;

/* Takes a byte in; 1 when `frame` holds a sound frame (without its sum). */
static inline int hapd_take(hapd_inbox *in, uint8_t byte, hapd_frame *frame) {
  if (byte) {
    if (in->length < sizeof in->bytes) {
      in->bytes[in->length++] = byte;
    } else {
      in->overlong = 1;
    }
    return 0;
  }
  size_t end = in->overlong ? 0 : in->length;
  in->length = 0;
  in->overlong = 0;
  frame->length = 0;
  for (size_t i = 0; i < end;) {
    size_t code = in->bytes[i++];
    for (size_t k = 1; k < code; k++) {
      if (i >= end || frame->length >= HAPD_LONGEST) {
        return 0;
      }
      frame->bytes[frame->length++] = in->bytes[i++];
    }
    if (code < 0xFF && i < end) {
      if (frame->length >= HAPD_LONGEST) {
        return 0;
      }
      frame->bytes[frame->length++] = 0;
    }
  }
  if (frame->length < 9) {
    return 0;
  }
  frame->length -= 2;
  uint16_t sum = (uint16_t)(frame->bytes[frame->length] | frame->bytes[frame->length + 1] << 8);
  return hapd_crc(frame->bytes, frame->length) == sum;
}

#endif
