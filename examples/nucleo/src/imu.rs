//! The configured sensor: an MTi on USART1, or a part on SPI1, in mode 3 at 6.25 MHz. The main program brings the part up and
//! passes it to `drive` ([`gyronet::service::spi_imu`]).

use core::cell::UnsafeCell;
use embassy_stm32::gpio::{Level, Output, Pin, Speed};
use embassy_stm32::mode::Blocking;
use embassy_stm32::spi::{self, MODE_3, mode::Master};
use embassy_stm32::{Peri, peripherals, time::Hertz, usart::BufferedUart};
use embassy_sync::{blocking_mutex::raw::CriticalSectionRawMutex as Raw, signal::Signal};
use embedded_hal::spi::{ErrorKind, ErrorType, Operation, SpiDevice};
use gyronet::sensor::{serial::Serial, xsens::Mti};
use gyronet::service::spi_imu::{self, Part, Wanted};

pub static WANTED: Wanted = Wanted::start();
/// The part that was brought up.
pub static PASSED: Signal<Raw, Part<Spi>> = Signal::new();

pub type Imu = spi_imu::Imu<Serial<BufferedUart<'static>, Mti>, Spi>;

type Parts = (spi::Spi<'static, Blocking, Master>, [Output<'static>; 2]);

struct Bus(UnsafeCell<Option<Parts>>);

// SAFETY: the main program brings a part up and passes it to `drive`, which passes it back: one has the bus at a time.
unsafe impl Sync for Bus {}

static BUS: Bus = Bus(UnsafeCell::new(None));

/// A handle of the bus with the number of its chip select.
#[derive(Debug, Clone, Copy)]
pub struct Spi(usize);

/// Starts the bus: clock, data out, data in, chip selects.
pub fn start(
    spi1: Peri<'static, peripherals::SPI1>,
    sck: Peri<'static, impl spi::SckPin<peripherals::SPI1>>,
    mosi: Peri<'static, impl spi::MosiPin<peripherals::SPI1>>,
    miso: Peri<'static, impl spi::MisoPin<peripherals::SPI1>>,
    first: Peri<'static, impl Pin>,
    second: Peri<'static, impl Pin>,
) -> [Spi; 2] {
    let mut config = spi::Config::default();
    (config.mode, config.frequency, config.gpio_speed) = (MODE_3, Hertz(6_250_000), Speed::Medium);
    let selects =
        [Output::new(first, Level::High, Speed::Medium), Output::new(second, Level::High, Speed::Medium)];
    let bus = spi::Spi::new_blocking(spi1, sck, mosi, miso, config);
    // SAFETY: no handle exists yet.
    unsafe { *BUS.0.get() = Some((bus, selects)) };
    [Spi(0), Spi(1)]
}

impl ErrorType for Spi {
    type Error = ErrorKind;
}

impl SpiDevice for Spi {
    fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), ErrorKind> {
        // SAFETY: see above.
        let parts = unsafe { &mut *BUS.0.get() }.as_mut();
        let (bus, select) =
            parts.and_then(|(bus, selects)| Some((bus, selects.get_mut(self.0)?))).ok_or(ErrorKind::Other)?;
        select.set_low();
        let done = operations.iter_mut().try_for_each(|operation| match operation {
            Operation::Read(bytes) => bus.blocking_read(bytes),
            Operation::Write(bytes) => bus.blocking_write(bytes),
            // No driver uses them.
            _ => Err(spi::Error::ModeFault),
        });
        select.set_high();
        done.map_err(|_| ErrorKind::Other)
    }
}
