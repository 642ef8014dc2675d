//! Positions, codes and protection of a frame as those of the board, and back.

use super::{Order, Place, Protection, Says, Sum};
use gyronet::can::e2e::{P01, P02, P05, Profile};
use gyronet::can::signal::{BitField, ByteOrder, OutsideFrame};
use gyronet::can::wheel::{ByteSum, Checksum, Code, Parts};

impl Place {
    pub(super) fn of(field: &BitField) -> Self {
        let order = match field.order() {
            ByteOrder::Intel => Order::Intel,
            ByteOrder::Motorola => Order::Motorola,
        };
        Self { start_bit: field.start(), bits: field.bits(), order, signed: field.is_signed() }
    }

    pub(super) fn field(&self) -> Result<BitField, OutsideFrame> {
        let order = match self.order {
            Order::Intel => ByteOrder::Intel,
            Order::Motorola => ByteOrder::Motorola,
        };
        BitField::new(self.start_bit, self.bits, order, self.signed)
    }
}

impl Says {
    pub(super) fn code(self) -> Result<Code, OutsideFrame> {
        let place = Place { start_bit: self.start_bit, bits: self.bits, order: self.order, signed: false };
        Ok(Code { field: place.field()?, value: self.value })
    }

    pub(super) fn of(Code { field, value }: Code) -> Self {
        let Place { start_bit, bits, order, .. } = Place::of(&field);
        Self { start_bit, bits, order, value }
    }
}

impl Sum {
    pub(super) fn sum(self, xor: bool) -> Result<ByteSum, OutsideFrame> {
        let start_bit = self.byte.unwrap_or(u8::MAX).saturating_mul(8);
        let byte = Place { start_bit, bits: 8, order: Order::Intel, signed: false };
        let Self { nibbles, with_id, with_length, without_counter, negated, start, last_xor, .. } = self;
        Ok(ByteSum {
            xor,
            nibbles,
            with_id,
            with_length,
            without_counter,
            negated,
            start,
            last: last_xor,
            ..ByteSum::new(parts(self.low.unwrap_or(byte), self.high)?)
        })
    }

    pub(super) fn of(sum: ByteSum) -> Self {
        let ByteSum { field, nibbles, with_id, with_length, without_counter, negated, start, last, .. } = sum;
        let low = Place::of(&field.low);
        let is_byte = low.bits == 8 && low.start_bit.is_multiple_of(8) && low.order == Order::Intel;
        let byte = is_byte.then_some(low.start_bit / 8);
        let (low, high) = ((!is_byte).then_some(low), field.high.as_ref().map(Place::of));
        Self {
            byte,
            low,
            high,
            nibbles,
            with_id,
            with_length,
            without_counter,
            negated,
            start,
            last_xor: last,
        }
    }
}

pub(super) fn parts(low: Place, high: Option<Place>) -> Result<Parts, OutsideFrame> {
    Ok(Parts { low: low.field()?, high: high.map(|high| high.field()).transpose()? })
}

impl Protection {
    pub(super) fn of(checksum: Checksum) -> Option<Self> {
        Some(match checksum {
            Checksum::None => return None,
            Checksum::J1850 { at } => Self::J1850 { byte: at },
            Checksum::Sum(sum) if sum.xor => Self::Xor(Sum::of(sum)),
            Checksum::Sum(sum) => Self::Sum(Sum::of(sum)),
            Checksum::E2e(Profile::P01(P01 { data_id, mode })) => Self::P01 { data_id, mode },
            Checksum::E2e(Profile::P02(P02 { data_ids })) => Self::P02 { data_ids },
            Checksum::E2e(Profile::P05(P05 { data_id })) => Self::P05 { data_id },
        })
    }

    pub(super) fn checksum(&self) -> Result<Checksum, OutsideFrame> {
        Ok(match *self {
            Self::J1850 { byte } => Checksum::J1850 { at: byte },
            Self::Xor(sum) => Checksum::Sum(sum.sum(true)?),
            Self::Sum(sum) => Checksum::Sum(sum.sum(false)?),
            Self::P01 { data_id, mode } => Checksum::E2e(Profile::P01(P01 { data_id, mode })),
            Self::P02 { data_ids } => Checksum::E2e(Profile::P02(P02 { data_ids })),
            Self::P05 { data_id } => Checksum::E2e(Profile::P05(P05 { data_id })),
        })
    }
}
