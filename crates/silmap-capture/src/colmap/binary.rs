//! COLMAP's binary files: little-endian, a count, then as many records.

use super::model::CameraModel;
use super::{CAMERA, CameraLine, FrameLine, ImageLine, RigLine, Rigid, Sensor};
use crate::error::CaptureFault;

/// Bytes of a point of an image: two coordinates and the number of a point in space.
const POINT_BYTES: u64 = 24;

/// The rest of a file, and what is read of it.
struct Bytes<'a> {
    rest: &'a [u8],
    /// `"image"`.
    what: &'static str,
    /// The record that is read, from one.
    record: u64,
    /// Records that the file says it has.
    count: u64,
}

fn damaged(reason: String) -> CaptureFault {
    CaptureFault::Damaged { reason }
}

impl<'a> Bytes<'a> {
    /// Reads all records of a file. What is kept grows with what is there, not with what the count claims.
    fn records<T>(
        bytes: &'a [u8],
        what: &'static str,
        read: impl Fn(&mut Self) -> Result<T, CaptureFault>,
    ) -> Result<Vec<T>, CaptureFault> {
        let mut file = Self {
            rest: bytes,
            what,
            record: 0,
            count: 0,
        };
        file.count = file.u64()?;
        let mut found = Vec::new();
        for record in 1..=file.count {
            file.record = record;
            found.push(read(&mut file)?);
        }
        Ok(found)
    }

    fn ends(&self) -> CaptureFault {
        damaged(match self.record {
            0 => format!("it ends before the number of {}s", self.what),
            record => format!("it ends inside {} {record} of {}", self.what, self.count),
        })
    }

    fn fault(&self, reason: &str) -> CaptureFault {
        damaged(format!(
            "{} {} of {}: {reason}",
            self.what, self.record, self.count
        ))
    }

    fn take<const N: usize>(&mut self) -> Result<[u8; N], CaptureFault> {
        let (head, rest) = self
            .rest
            .split_first_chunk::<N>()
            .ok_or_else(|| self.ends())?;
        self.rest = rest;
        Ok(*head)
    }

    fn u8(&mut self) -> Result<u8, CaptureFault> {
        Ok(self.take::<1>()?[0])
    }

    fn u32(&mut self) -> Result<u32, CaptureFault> {
        Ok(u32::from_le_bytes(self.take()?))
    }

    fn i32(&mut self) -> Result<i32, CaptureFault> {
        Ok(i32::from_le_bytes(self.take()?))
    }

    fn u64(&mut self) -> Result<u64, CaptureFault> {
        Ok(u64::from_le_bytes(self.take()?))
    }

    fn f64(&mut self) -> Result<f64, CaptureFault> {
        Ok(f64::from_le_bytes(self.take()?))
    }

    fn pose(&mut self) -> Result<Option<Rigid>, CaptureFault> {
        let mut numbers = [0.0; 7];
        for number in &mut numbers {
            *number = self.f64()?;
        }
        Ok(Rigid::new(numbers))
    }

    fn sensor(&mut self) -> Result<Sensor, CaptureFault> {
        Ok((self.i32()?, self.u32()?))
    }

    fn skip(&mut self, bytes: Option<u64>) -> Result<(), CaptureFault> {
        let count = bytes.and_then(|b| usize::try_from(b).ok());
        let rest = count.and_then(|c| self.rest.get(c..));
        self.rest = rest.ok_or_else(|| self.ends())?;
        Ok(())
    }
}

pub(super) fn cameras(bytes: &[u8]) -> Result<Vec<CameraLine>, CaptureFault> {
    Bytes::records(bytes, "camera", |file| {
        let id = file.u32()?;
        let number = file.i32()?;
        let model = CameraModel::of_number(number)
            .ok_or_else(|| file.fault(&format!("no camera model has the number {number}")))?;
        let size = (file.u64()?, file.u64()?);
        let mut params = Vec::new();
        for _ in 0..model.param_count() {
            let value = file.f64()?;
            if !value.is_finite() {
                return Err(file.fault("a parameter is not finite"));
            }
            params.push(value);
        }
        Ok(CameraLine {
            id,
            model,
            size,
            params,
        })
    })
}

pub(super) fn images(bytes: &[u8]) -> Result<Vec<ImageLine>, CaptureFault> {
    Bytes::records(bytes, "image", |file| {
        let id = file.u32()?;
        let camera_from_world = file.pose()?;
        let camera = file.u32()?;
        let end = file
            .rest
            .iter()
            .position(|&b| b == 0)
            .ok_or_else(|| file.ends())?;
        let name = std::str::from_utf8(&file.rest[..end]);
        let name = name.map_err(|_| file.fault("its name is not UTF-8 text"))?;
        if name.is_empty() {
            return Err(file.fault("it has no name"));
        }
        file.rest = &file.rest[end + 1..];
        let points = file.u64()?;
        file.skip(points.checked_mul(POINT_BYTES))?;
        Ok(ImageLine {
            id,
            camera,
            camera_from_world,
            name: name.to_owned(),
        })
    })
}

pub(super) fn rigs(bytes: &[u8]) -> Result<Vec<RigLine>, CaptureFault> {
    Bytes::records(bytes, "rig", |file| {
        let id = file.u32()?;
        let count = file.u32()?;
        let mut sensors = Vec::new();
        for k in 0..count {
            let sensor = file.sensor()?;
            let pose = match k {
                0 => Some(Rigid::IDENTITY),
                _ => match file.u8()? {
                    0 => None,
                    _ => file.pose()?,
                },
            };
            sensors.push((sensor, pose));
        }
        Ok(RigLine { id, sensors })
    })
}

pub(super) fn frames(bytes: &[u8]) -> Result<Vec<FrameLine>, CaptureFault> {
    Bytes::records(bytes, "frame", |file| {
        let _id = file.u32()?;
        let rig = file.u32()?;
        let rig_from_world = file.pose()?;
        let count = file.u32()?;
        let mut images = Vec::new();
        for _ in 0..count {
            let (kind, _) = file.sensor()?;
            let image = file.u64()?;
            if kind == CAMERA {
                images.extend(u32::try_from(image));
            }
        }
        Ok(FrameLine {
            rig,
            rig_from_world,
            images,
        })
    })
}
