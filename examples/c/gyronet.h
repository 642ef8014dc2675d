#ifndef GYRONET_H
#define GYRONET_H

/* Made from src/lib.rs by a test: GYRONET_WRITE_PAGES=1 cargo test -p gyronet-host-tests --test image -- c_header */

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/*
 Version of this interface: it rises when a structure or a function changes.
 */
#define GYRONET_ABI_VERSION 1

/*
 Frames that wait for the bus; a newer one then pushes out the oldest, which counts as lost.
 */
#define GYRONET_QUEUE 24

/*
 What a function says of its call.
 */
typedef enum GyronetResult {
  /*
   Done.
   */
  GYRONET_RESULT_OK = 0,
  /*
   A pointer is null.
   */
  GYRONET_RESULT_NULL,
  /*
   The memory is smaller than gyronet_size().
   */
  GYRONET_RESULT_SMALL,
  /*
   The memory's address is no multiple of gyronet_align().
   */
  GYRONET_RESULT_MISALIGNED,
  /*
   An angle of the mounting or the latitude is out of range.
   */
  GYRONET_RESULT_SETTINGS,
  /*
   The description of the wheels cannot be used, or a frame has the identifier of a message of the board.
   */
  GYRONET_RESULT_WHEELS,
  /*
   A value of the sample is beyond the range of all parts: it counts as a failed read.
   */
  GYRONET_RESULT_RANGE,
  /*
   The input was not used; the messages on the bus report it.
   */
  GYRONET_RESULT_REFUSED,
} GyronetResult;

/*
 A board: its state is opaque.
 */
typedef struct Gyronet Gyronet;

/*
 The place of a wheel's speed on the bus, as a DBC file says it.
 */
typedef struct GyronetWheel {
  /*
   Identifier of the frame.
   */
  uint32_t id;
  /*
   The identifier has 29 bits.
   */
  bool is_extended;
  /*
   Start bit as in the DBC file.
   */
  uint8_t start;
  /*
   Number of bits, 1 to 32; 0 where the wheel has no speed.
   */
  uint8_t bits;
  /*
   Motorola byte order (@0 in the DBC file).
   */
  bool is_big_endian;
  /*
   Two's complement.
   */
  bool is_signed;
  /*
   km/h for each bit.
   */
  float factor_kmh;
  /*
   km/h at raw value zero.
   */
  float offset_kmh;
} GyronetWheel;

/*
 What belongs to a vehicle.
 */
typedef struct GyronetSettings {
  /*
   Rotation of the sensor against the vehicle: about x (forward), then y (left), then z (up), degrees.
   */
  float mounting_deg[3];
  /*
   Latitude, degrees, north positive; NAN where unknown.
   */
  float latitude_deg;
  /*
   Front left, front right, rear left, rear right: none, two or four of them.
   */
  struct GyronetWheel wheels[4];
} GyronetSettings;

/*
 A reading of an inertial sensor: x forward, y left, z up.
 */
typedef struct GyronetSample {
  /*
   Time of the reading by the sensor's clock, microseconds; UINT64_MAX where it sends none.
   */
  uint64_t time_us;
  /*
   Specific force, m/s^2.
   */
  float specific_force[3];
  /*
   Angular rate, rad/s.
   */
  float angular_rate[3];
  /*
   Temperature, deg C; NAN where there is none.
   */
  float temperature;
  /*
   The sensor says that an axis is saturated.
   */
  bool is_saturated;
} GyronetSample;

/*
 A CAN frame with up to eight bytes.
 */
typedef struct GyronetFrame {
  /*
   Identifier, 11 or 29 bits.
   */
  uint32_t id;
  /*
   The identifier has 29 bits.
   */
  bool is_extended;
  /*
   Number of bytes, 0 to 8.
   */
  uint8_t length;
  /*
   The bytes.
   */
  uint8_t data[8];
} GyronetFrame;

/*
 The newest corrected yaw rate.
 */
typedef struct GyronetRate {
  /*
   Corrected yaw rate, rad/s, left positive.
   */
  float rate;
  /*
   Expected error of its mean over a second, rad/s, 1 sigma; infinite while unknown.
   */
  float sigma;
  /*
   0 unusable, 1 degraded, 2 good.
   */
  uint8_t quality;
  /*
   Faults, as in message 0x1A2.
   */
  uint16_t faults;
} GyronetRate;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

/*
 Returns [`GYRONET_ABI_VERSION`] of the library: compare it with that of the header.
 */
uint32_t gyronet_abi_version(void);

/*
 Returns the number of bytes that a board needs.
 */
size_t gyronet_size(void);

/*
 Returns the alignment that a board needs.
 */
size_t gyronet_align(void);

/*
 Returns the settings of a level sensor without wheels and without a latitude.
 */
struct GyronetSettings gyronet_default_settings(void);

/*
 Makes a board in `memory` (aligned, `size` bytes, kept by the caller) and stores it in `board`. It needs about
 16 KiB of stack, once.

 # Safety
 `memory` must be writable for `size` bytes as long as the board is used; `settings` and `board` must be valid.
 */
enum GyronetResult gyronet_init(void *memory,
                                size_t size,
                                const struct GyronetSettings *settings,
                                struct Gyronet **board);

/*
 Passes in bytes that an MTi has sent, received until `now_us`. A refused message is reported on the bus.

 # Safety
 `bytes` must be readable for `length` bytes; `board` must come from [`gyronet_init`].
 */
enum GyronetResult gyronet_mti(struct Gyronet *board,
                               const uint8_t *bytes,
                               size_t length,
                               uint64_t now_us);

/*
 Passes in a reading of another sensor; null for a read that failed.

 # Safety
 `sample` must be null or valid; `board` must come from [`gyronet_init`].
 */
enum GyronetResult gyronet_sample(struct Gyronet *board,
                                  const struct GyronetSample *sample,
                                  uint64_t now_us);

/*
 Passes in a frame from the bus, as of the wheels. A frame that is none of the board's is passed over.

 # Safety
 `frame` must be null or valid; `board` must come from [`gyronet_init`].
 */
enum GyronetResult gyronet_receive(struct Gyronet *board,
                                   const struct GyronetFrame *frame,
                                   uint64_t now_us);

/*
 Does what is due without an input, as reporting silence: call it about every millisecond.

 # Safety
 `board` must be null or come from [`gyronet_init`].
 */
enum GyronetResult gyronet_poll(struct Gyronet *board, uint64_t now_us);

/*
 Takes the next frame to send; false where none waits.

 # Safety
 `frame` must be valid; `board` must come from [`gyronet_init`].
 */
bool gyronet_next_frame(struct Gyronet *board, struct GyronetFrame *frame);

/*
 Copies the newest rate; all zero before the first one.

 # Safety
 `rate` must be valid; `board` must come from [`gyronet_init`].
 */
enum GyronetResult gyronet_rate(const struct Gyronet *board, struct GyronetRate *rate);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* GYRONET_H */
