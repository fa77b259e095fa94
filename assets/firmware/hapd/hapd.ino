/* Strain gauges to HapDef Studio: an Arduino Due, or any Arduino with analogue inputs.
 *
 * Put hapd_config.h of the limb's report beside this file, or change what stands between the lines, upload, and choose the
 * port in the studio. See ../PROTOCOL.md.
 * On a Due use the native USB port: at 115 200 baud no more than 397 frames a second go through.
 */
#include "hapd_frame.h"

#if defined(__has_include)
#if __has_include("hapd_config.h")
#include "hapd_config.h"
#endif
#endif

/* ------------------------------------------------------------------------------------------------- */
#ifndef HAPD_PINS
#define HAPD_PINS {A0, A1, A2, A3, A4, A5, A6, A7, A8, A9, A10, A11}
#define HAPD_BOARD 0x48415001   /* another number for each board */
#define HAPD_NAME "limb"
#define HAPD_REFERENCE_MV 3300  /* of the converter: 3300 on a Due, 5000 on most others */
#define HAPD_SUPPLY_MV 5000     /* of the bridges */
#define HAPD_GAIN_MILLI 330000  /* of the amplifiers, in thousandths */
#endif
static const uint8_t PINS[] = HAPD_PINS;
static const uint32_t BOARD = HAPD_BOARD;
static const char NAME[] = HAPD_NAME;
static const uint16_t REFERENCE_MV = HAPD_REFERENCE_MV, SUPPLY_MV = HAPD_SUPPLY_MV;
static const uint32_t GAIN_MILLI = HAPD_GAIN_MILLI;
static uint16_t rate_hz = 1000;
/* ------------------------------------------------------------------------------------------------- */

#if defined(ARDUINO_ARCH_SAM)
#define WIRE SerialUSB
static const uint8_t BITS = 12;
#else
#define WIRE Serial
static const uint8_t BITS = 10;
#endif

static const uint8_t CHANNELS = sizeof PINS / sizeof PINS[0];
static hapd_frame frame;
static hapd_inbox inbox;
static uint8_t wire[HAPD_WIRE];
static uint16_t sequence = 0;
static uint32_t overruns = 0, next_us = 0, told_ms = 0, status_ms = 0;
static bool sending = false;

static void send() { WIRE.write(wire, hapd_end(&frame, wire)); }

static void hello() {
  hapd_begin(&frame, HAPD_HELLO, sequence++, micros());
  hapd_put_hello(&frame, BOARD, CHANNELS, BITS, REFERENCE_MV, SUPPLY_MV, GAIN_MILLI, rate_hz, NAME);
  send();
  told_ms = millis();
}

static void status() {
  hapd_begin(&frame, HAPD_STATUS, sequence++, micros());
  hapd_put(&frame, overruns, 4);
  hapd_put(&frame, 0x7FFF, 2); /* no thermometer */
  send();
  status_ms = millis();
}

static void sample() {
  uint32_t counts[sizeof PINS];
  uint32_t now = micros();
  for (uint8_t k = 0; k < CHANNELS; k++) {
    counts[k] = analogRead(PINS[k]);
  }
  hapd_begin(&frame, HAPD_DATA, sequence++, now);
  hapd_put_counts(&frame, counts, CHANNELS, BITS);
  send();
}

static void obey(const hapd_frame &asked) {
  const uint8_t *p = asked.bytes + 7;
  switch (asked.bytes[0]) {
  case HAPD_ASK_HELLO:
    hello();
    break;
  case HAPD_START:
    sending = true;
    next_us = micros();
    break;
  case HAPD_STOP:
    sending = false;
    break;
  case HAPD_RATE:
    if (asked.length == 9) {
      rate_hz = p[0] | p[1] << 8;
      if (rate_hz < 1) rate_hz = 1;
      hello();
    }
    break;
  case HAPD_PING:
    if (asked.length == 11) {
      uint32_t token = p[0] | (uint32_t)p[1] << 8 | (uint32_t)p[2] << 16 | (uint32_t)p[3] << 24;
      hapd_begin(&frame, HAPD_PONG, sequence++, micros());
      hapd_put(&frame, token, 4);
      send();
    }
    break;
  }
}

void setup() {
  WIRE.begin(115200);
#if defined(ARDUINO_ARCH_SAM)
  analogReadResolution(BITS);
#endif
  hello();
}

void loop() {
  static hapd_frame asked;
  while (WIRE.available()) {
    if (hapd_take(&inbox, WIRE.read(), &asked)) obey(asked);
  }
  if (!sending) {
    if (millis() - told_ms >= 1000) hello();
    return;
  }
  uint32_t period = 1000000UL / rate_hz;
  if ((int32_t)(micros() - next_us) < 0) return;
  sample();
  next_us += period;
  /* What could not be sampled in time is counted and left out, so that the rate stays true. */
  while ((int32_t)(micros() - next_us) > (int32_t)period) {
    next_us += period;
    overruns++;
  }
  if (millis() - status_ms >= 1000) status();
}
