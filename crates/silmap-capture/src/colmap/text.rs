//! COLMAP's files of text.

use super::model::CameraModel;
use super::{CAMERA, CameraLine, FrameLine, ImageLine, RigLine, Rigid, Sensor};
use crate::error::CaptureFault;

/// Numbers before the name in a line of `images.txt`: id, rotation, translation, camera.
const BEFORE_NAME: usize = 9;

fn fault(line: usize, reason: impl Into<String>) -> CaptureFault {
    CaptureFault::Line {
        line,
        reason: reason.into(),
    }
}

/// Lines that say something, with their numbers.
fn lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    (text.lines().enumerate())
        .map(|(k, line)| (k + 1, line.trim()))
        .filter(|(_, line)| !line.is_empty() && !line.starts_with('#'))
}

/// The words of a line, each asked for by what it is.
struct Words<'a> {
    line: usize,
    words: std::str::SplitWhitespace<'a>,
}

impl<'a> Words<'a> {
    fn of((line, text): (usize, &'a str)) -> Self {
        Self {
            line,
            words: text.split_whitespace(),
        }
    }

    fn word(&mut self, what: &str) -> Result<&'a str, CaptureFault> {
        let word = self.words.next();
        word.ok_or_else(|| fault(self.line, format!("{what} is missing")))
    }

    fn parse<T: std::str::FromStr>(&mut self, what: &str) -> Result<T, CaptureFault> {
        let word = self.word(what)?;
        let is_none = || fault(self.line, format!("{what} cannot be {word:?}"));
        word.parse().map_err(|_| is_none())
    }

    fn numbers(&mut self, what: &str) -> Result<[f64; 7], CaptureFault> {
        let mut found = [0.0; 7];
        for number in &mut found {
            *number = self.parse(what)?;
        }
        Ok(found)
    }

    fn sensor(&mut self) -> Result<Sensor, CaptureFault> {
        let kind = match self.word("the sensor's kind")? {
            "CAMERA" => CAMERA,
            other => other.parse().unwrap_or(CAMERA + 1),
        };
        Ok((kind, self.parse("the sensor's number")?))
    }
}

/// `CAMERA_ID MODEL WIDTH HEIGHT PARAMS[]`.
pub(super) fn cameras(text: &str) -> Result<Vec<CameraLine>, CaptureFault> {
    let line = |line: (usize, &str)| {
        let mut words = Words::of(line);
        let id = words.parse("the camera's number")?;
        let name = words.word("the camera's model")?;
        let model = CameraModel::of_name(name);
        let model =
            model.ok_or_else(|| fault(line.0, format!("no camera model is called {name:?}")))?;
        let size = (
            words.parse("the image's width")?,
            words.parse("the image's height")?,
        );
        let mut params: Vec<f64> = Vec::new();
        for word in words.words.by_ref() {
            let number = word.parse().ok().filter(|v: &f64| v.is_finite());
            params.push(number.ok_or_else(|| {
                fault(
                    line.0,
                    format!("a parameter of the camera cannot be {word:?}"),
                )
            })?);
        }
        if params.len() != model.param_count() {
            let (wanted, found) = (model.param_count(), params.len());
            return Err(fault(
                line.0,
                format!("{name} has {wanted} parameters, and {found} are given"),
            ));
        }
        Ok(CameraLine {
            id,
            model,
            size,
            params,
        })
    };
    lines(text).map(line).collect()
}

/// `IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME`, or `IMAGE_ID CAMERA_ID NAME` where the pose is on the frame; a line of points, which
/// may be empty, follows each.
pub(super) fn images(text: &str) -> Result<Vec<ImageLine>, CaptureFault> {
    let mut found = Vec::new();
    let mut rest = text.lines().enumerate();
    while let Some((k, line)) = rest.next() {
        let start = line.trim_start();
        if start.is_empty() || start.starts_with('#') {
            continue;
        }
        let image = image((k + 1, start))?;
        if let Some((k, points)) = rest.next() {
            let mut words = points.split_whitespace();
            if let Some(word) = words.find(|word| word.parse::<f64>().is_err()) {
                let reason = format!(
                    "the points of image {} are expected here, an empty line at least, and {word:?} is none",
                    image.name
                );
                return Err(fault(k + 1, reason));
            }
        }
        found.push(image);
    }
    Ok(found)
}

fn image(line: (usize, &str)) -> Result<ImageLine, CaptureFault> {
    let is_number = |word: &str| word.parse::<f64>().is_ok();
    let leading = (line.1.split_whitespace())
        .take_while(|word| is_number(word))
        .take(BEFORE_NAME)
        .count();
    let mut words = Words::of(line);
    let id = words.parse("the image's number")?;
    let is_short = leading == 2 && line.1.split_whitespace().count() > 2;
    let camera_from_world = match is_short {
        true => None,
        false => Rigid::new(words.numbers("the image's pose")?),
    };
    let camera = words.parse("the image's camera")?;
    let name = after_words(line.1, if is_short { 2 } else { BEFORE_NAME });
    if name.is_empty() {
        return Err(fault(line.0, "the image's name is missing"));
    }
    Ok(ImageLine {
        id,
        camera,
        camera_from_world,
        name: name.to_owned(),
    })
}

/// What follows after so many words, blanks within it kept.
fn after_words(line: &str, count: usize) -> &str {
    let mut rest = line.trim_start();
    for _ in 0..count {
        rest = match rest.split_once(char::is_whitespace) {
            Some((_, after)) => after.trim_start(),
            None => "",
        };
    }
    rest.trim_end()
}

/// `RIG_ID NUM_SENSORS REF_SENSOR_TYPE REF_SENSOR_ID (SENSOR_TYPE SENSOR_ID HAS_POSE [QW QX QY QZ TX TY TZ])[]`.
pub(super) fn rigs(text: &str) -> Result<Vec<RigLine>, CaptureFault> {
    let line = |line| {
        let mut words = Words::of(line);
        let id = words.parse("the rig's number")?;
        let count: u64 = words.parse("the number of sensors")?;
        let mut sensors = Vec::new();
        for k in 0..count {
            let sensor = words.sensor()?;
            let pose = match k {
                0 => Some(Rigid::IDENTITY),
                _ => match words.parse::<i64>("whether a sensor has a pose")? {
                    0 => None,
                    _ => Rigid::new(words.numbers("the sensor's pose")?),
                },
            };
            sensors.push((sensor, pose));
        }
        Ok(RigLine { id, sensors })
    };
    lines(text).map(line).collect()
}

/// `FRAME_ID RIG_ID QW QX QY QZ TX TY TZ NUM_DATA_IDS (SENSOR_TYPE SENSOR_ID DATA_ID)[]`.
pub(super) fn frames(text: &str) -> Result<Vec<FrameLine>, CaptureFault> {
    let line = |line| {
        let mut words = Words::of(line);
        let _: u64 = words.parse("the frame's number")?;
        let rig = words.parse("the frame's rig")?;
        let rig_from_world = Rigid::new(words.numbers("the frame's pose")?);
        let count: u64 = words.parse("the number of data")?;
        let mut images = Vec::new();
        for _ in 0..count {
            let (kind, _) = words.sensor()?;
            let image: u64 = words.parse("the number of an image")?;
            if kind == CAMERA {
                images.extend(u32::try_from(image));
            }
        }
        Ok(FrameLine {
            rig,
            rig_from_world,
            images,
        })
    };
    lines(text).map(line).collect()
}
