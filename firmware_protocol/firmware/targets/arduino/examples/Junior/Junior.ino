/* Junior on any Arduino board with 2 KiB of RAM, by the Arduino functions alone.
 *
 * The pins are those of docs/build.md. Change them, or how a sensor is read, and nothing else: what the robot does and says
 * is the library's. On an ATmega328P the firmware of its own (make flash) has smoother motors and tighter timing; this
 * sketch runs where that does not, and is the place to begin from with other sensors or another motor driver.
 */
#include <EEPROM.h>
#include <JuniorHIL.h>
#if defined(__AVR__)
#include <avr/wdt.h>
#endif

const uint8_t ARM[2] = {2, 3};      // switches to GND, left and right
const uint8_t START = 4;            // start module, high is go; 10 kohm to GND
const uint8_t STANDBY = 5;          // motor driver
const uint8_t FORWARD[2] = {6, 8};  // AIN1, BIN1
const uint8_t BACKWARD[2] = {7, 11};  // AIN2, BIN2
const uint8_t PWM[2] = {9, 10};     // PWMA, PWMB
const uint8_t EYE[2] = {A0, A1};
const uint8_t GROUND[2] = {A2, A3};  // floor sensors
const uint8_t BATTERY = A6;         // divider 10 kohm, 10 kohm
const uint16_t BATTERY_FULL_MV = 10000;  // at 1024 counts
const uint32_t PERIOD_US = 5000;

static struct junior robot;
static uint8_t waiting[192];  // bytes that Serial has no room for yet
static uint8_t first, used;
static uint32_t begun;  // when this control period's work began

extern "C" {

uint64_t hal_micros(void *) {
  static uint32_t last, wraps;
  uint32_t now = micros();
  if (now < last) {
    wraps++;
  }
  last = now;
  return (uint64_t)wraps << 32 | now;
}

uint16_t hal_used(void *) { return micros() - begun; }

uint64_t hal_uid(void *) { return 1; }  // tell several robots apart by their SYS_ID

uint16_t hal_eye(void *, uint8_t side) { return analogRead(EYE[side]); }
uint16_t hal_floor(void *, uint8_t side) { return analogRead(GROUND[side]); }
uint8_t hal_arm(void *, uint8_t side) { return digitalRead(ARM[side]) == LOW; }
uint8_t hal_start(void *) { return digitalRead(START) == HIGH; }
uint16_t hal_battery(void *) { return (uint32_t)analogRead(BATTERY) * BATTERY_FULL_MV / 1024; }

bool hal_has_encoders(void *) { return false; }
bool hal_has_ground(void *) { return false; }
int32_t hal_travel(void *, uint8_t) { return 0; }
int32_t hal_ground(void *) { return 0; }

void hal_set_wheels(void *, int16_t left, int16_t right) {
  const int16_t effort[2] = {left, right};
  for (uint8_t side = 0; side < 2; side++) {
    digitalWrite(FORWARD[side], effort[side] > 0);
    digitalWrite(BACKWARD[side], effort[side] < 0);
    analogWrite(PWM[side], (uint32_t)abs(effort[side]) * 255 / 1000);
  }
  digitalWrite(STANDBY, left != 0 || right != 0);
}

int16_t hal_read(void *) { return Serial.read(); }

uint16_t hal_write_room(void *) { return sizeof waiting - used; }

void hal_write(void *, const uint8_t *data, uint8_t length) {
  for (uint8_t i = 0; i < length; i++) {
    waiting[(first + used++) % sizeof waiting] = data[i];
  }
}

uint8_t hal_nvm_read(void *, uint16_t address) { return EEPROM.read(address); }

bool hal_nvm_ready(void *) {
#if defined(__AVR__)
  return eeprom_is_ready();
#else
  return true;
#endif
}

void hal_nvm_write(void *, uint16_t address, uint8_t value) { EEPROM.write(address, value); }

void hal_reboot(void *) {
#if defined(__AVR__)
  wdt_enable(WDTO_15MS);
  for (;;) {
  }
#elif defined(ARDUINO_ARCH_ESP32) || defined(ARDUINO_ARCH_ESP8266)
  ESP.restart();
#else
  NVIC_SystemReset();
#endif
}

}  // extern "C"

void setup() {
#if defined(__AVR__)
  wdt_disable();
#endif
  for (uint8_t side = 0; side < 2; side++) {
    pinMode(ARM[side], INPUT_PULLUP);
    pinMode(FORWARD[side], OUTPUT);
    pinMode(BACKWARD[side], OUTPUT);
    pinMode(PWM[side], OUTPUT);
  }
  pinMode(START, INPUT);
  pinMode(STANDBY, OUTPUT);
  Serial.begin(115200);
  robot_power_on(&robot.robot, nullptr);
}

void loop() {
  static uint32_t due;
  if (micros() - due >= PERIOD_US) {
    due += PERIOD_US;
    begun = micros();
    robot_tick(&robot.robot);
  }
  while (used > 0 && Serial.availableForWrite() > 0) {
    Serial.write(waiting[first]);
    first = (first + 1) % sizeof waiting;
    used--;
  }
}
