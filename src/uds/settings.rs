//! This module makes each setting a data identifier, for testers that cannot decode the records of this library.
//!
//! Numbers are big-endian, real ones in IEEE 754; NaN means that an optional setting is absent. Structures are in
//! postcard's encoding. A write changes the stored configuration, which is checked as a whole and used from the next
//! start on. A read returns the value for the next start. `tools/README.md` has units and ranges.

use super::response::{Nrc, Response, decode, exactly, nrc, put, put_record};
use crate::can::config::{BoschSettings, E2e, Vdc2Settings};
use crate::can::diagnosis::DiagnosisIds;
use crate::can::latitude::LatitudeSettings;
use crate::compensate::{Lag, Mode};
use crate::fog::FogNetUse;
use crate::service::message::Request;
use crate::service::{Device, MappedSlots};
use crate::store::{Configuration, FogPart, ImuPart, Record};
use crate::units::AngularRate;
use embedded_storage::nor_flash::NorFlash;

/// A setting, encoded as the value of its data identifier.
trait Setting {
    /// Appends the encoded value.
    fn put(&self, out: &mut Response) -> Result<(), Nrc>;
    /// Replaces the value by a decoded one.
    fn replace(&mut self, bytes: &[u8]) -> Result<(), Nrc>;
}

/// Lists the settings with their identifiers.
macro_rules! settings {
    ($configuration:ident: $($id:literal => $place:expr,)*) => {
        fn put_setting(id: u16, $configuration: &mut Configuration, out: &mut Response) -> Result<(), Nrc> {
            match id {
                $($id => Setting::put(&$place, out),)*
                _ => Err(Nrc::RequestOutOfRange),
            }
        }

        fn take_setting(id: u16, $configuration: &mut Configuration, bytes: &[u8]) -> Result<(), Nrc> {
            match id {
                $($id => Setting::replace(&mut $place, bytes),)*
                _ => Err(Nrc::RequestOutOfRange),
            }
        }
    };
}

settings! { c:
    0x0201 => c.imu,
    0x0202 => c.fog,
    0x0203 => c.fog_ids,
    0x0204 => c.latitude_deg,
    0x0205 => c.fog_lane.tilt_deg,
    0x0206 => c.fog_lane.fognet,
    0x0207 => c.fog_lane.latitude_frame,
    0x0208 => c.slcan_inputs,
    0x0209 => c.diagnosis,
    0x020A => c.mounting.roll_deg,
    0x020B => c.mounting.pitch_deg,
    0x020C => c.mounting.yaw_deg,
    0x020D => c.static_init.gyro_std,
    0x020E => c.static_init.accel_std,
    0x020F => c.static_init.gyro_drift,
    0x0210 => c.static_init.accel_drift,
    0x0211 => c.static_init.gyro_bias,
    0x0212 => c.compensate.mode,
    0x0213 => c.compensate.lag,
    0x0214 => c.compensate.max_mean,
    0x0215 => c.compensate.max_single,
    0x0216 => c.compensate.max_carry,
    0x0217 => c.can.bits_per_second,
    0x0218 => c.can.bosch,
    0x0219 => c.can.yaw.as_mut().ok_or(Nrc::ConditionsNotCorrect)?.ids,
    0x021A => c.can.yaw.as_mut().ok_or(Nrc::ConditionsNotCorrect)?.period_ms,
    0x021B => c.can.yaw.as_mut().ok_or(Nrc::ConditionsNotCorrect)?.e2e,
    0x021C => c.can.vdc2,
    0x021D => c.fog_serial,
    0x021E => c.learn,
}

/// Appends the value of a setting.
#[inline(never)]
pub(super) fn read<R: NorFlash, W: MappedSlots>(
    id: u16,
    device: &Device<R, W>,
    out: &mut Response,
) -> Result<(), Nrc> {
    put_setting(id, &mut { *device.next_configuration() }, out)
}

/// Stores the configuration with a new value of one setting.
#[inline(never)]
pub(super) fn write<R: NorFlash, W: MappedSlots>(
    id: u16,
    bytes: &[u8],
    device: &mut Device<R, W>,
) -> Result<(), Nrc> {
    let mut configuration = *device.next_configuration();
    take_setting(id, &mut configuration, bytes)?;
    let version = Configuration::VERSION;
    device.act(&Request::SetConfiguration { version, configuration: &configuration }).map_err(nrc)
}

/// Implements [`Setting`] for numbers with `to_be_bytes` and `from_be_bytes`.
macro_rules! numbers {
    ($($type:ty),*) => {$(
        impl Setting for $type {
            fn put(&self, out: &mut Response) -> Result<(), Nrc> {
                put(out, &self.to_be_bytes())
            }

            fn replace(&mut self, bytes: &[u8]) -> Result<(), Nrc> {
                *self = Self::from_be_bytes(exactly(bytes)?);
                Ok(())
            }
        }
    )*};
}

numbers!(f32, u32, u16);

/// Implements [`Setting`] for structures and enums, in postcard's encoding; a variant without content is one byte,
/// its index.
macro_rules! records {
    ($($type:ty),*) => {$(
        impl Setting for $type {
            fn put(&self, out: &mut Response) -> Result<(), Nrc> {
                put_record(out, self)
            }

            fn replace(&mut self, bytes: &[u8]) -> Result<(), Nrc> {
                *self = decode(bytes)?;
                Ok(())
            }
        }
    )*};
}

records!(
    ImuPart,
    Option<FogPart>,
    FogNetUse,
    Option<LatitudeSettings>,
    bool,
    Mode,
    Lag,
    Option<BoschSettings>,
    E2e,
    Option<Vdc2Settings>
);

impl Setting for [u16; 3] {
    fn put(&self, out: &mut Response) -> Result<(), Nrc> {
        self.iter().try_for_each(|id| id.put(out))
    }

    fn replace(&mut self, bytes: &[u8]) -> Result<(), Nrc> {
        let [a, b, c, d, e, f] = exactly(bytes)?;
        *self = [[a, b], [c, d], [e, f]].map(u16::from_be_bytes);
        Ok(())
    }
}

impl Setting for Option<f32> {
    fn put(&self, out: &mut Response) -> Result<(), Nrc> {
        self.unwrap_or(f32::NAN).put(out)
    }

    fn replace(&mut self, bytes: &[u8]) -> Result<(), Nrc> {
        *self = Some(f32::from_be_bytes(exactly(bytes)?)).filter(|value| !value.is_nan());
        Ok(())
    }
}

/// A rate is encoded as f32 in rad/s.
impl Setting for AngularRate {
    fn put(&self, out: &mut Response) -> Result<(), Nrc> {
        (self.rad_per_sec() as f32).put(out)
    }

    fn replace(&mut self, bytes: &[u8]) -> Result<(), Nrc> {
        let rate = f32::from_be_bytes(exactly(bytes)?);
        *self = Self::from_rad_per_sec(rate).map_err(|_| Nrc::RequestOutOfRange)?;
        Ok(())
    }
}

/// The three identifiers are one setting, because they must differ: a byte that is 1 for 29 bits, then the
/// identifiers of requests, functional requests, and responses.
impl Setting for DiagnosisIds {
    fn put(&self, out: &mut Response) -> Result<(), Nrc> {
        put(out, &[u8::from(self.extended)])?;
        [self.request, self.functional, self.response].iter().try_for_each(|id| id.put(out))
    }

    fn replace(&mut self, bytes: &[u8]) -> Result<(), Nrc> {
        let (extended, ids) = bytes.split_first().ok_or(Nrc::IncorrectMessageLengthOrInvalidFormat)?;
        self.extended = match extended {
            0 => false,
            1 => true,
            _ => return Err(Nrc::RequestOutOfRange),
        };
        let [request, functional, response]: [[u8; 4]; 3] = bytemuck::cast(exactly::<12>(ids)?);
        [self.request, self.functional, self.response] =
            [request, functional, response].map(u32::from_be_bytes);
        Ok(())
    }
}
