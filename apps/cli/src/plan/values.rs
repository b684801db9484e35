//! The values of flags: text in, numbers out, or a sentence that says what would have been right.

use glam::DVec3;
use ondelette_io::Panel;
use ondelette_radiosity::Rgb;
use std::time::Duration;

/// More threads than any machine that we know of can use on a scene.
const MOST_THREADS: usize = 1024;

/// A fraction from `1%`, `0.5 %` or `1` (per cent in any case).
pub(crate) fn percent(text: &str) -> Result<f64, String> {
    let number = text.trim().strip_suffix('%').unwrap_or(text).trim();
    match number.parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value / 100.0),
        _ => Err(format!("--error {text}: that is no percentage; write 1% or 0.5%")),
    }
}

/// A time span from `10s`, `2m`, `500ms` or `1h`.
pub(crate) fn duration(text: &str) -> Result<Duration, String> {
    let wrong = || format!("--max-time {text}: that is no time; write 500ms, 10s, 2m or 1h");
    let trimmed = text.trim();
    let unit = trimmed.find(|c: char| c.is_ascii_alphabetic()).ok_or_else(wrong)?;
    let seconds = match &trimmed[unit..] {
        "ms" => 1e-3,
        "s" => 1.0,
        "m" | "min" => 60.0,
        "h" => 3600.0,
        _ => return Err(wrong()),
    };
    let number: f64 = trimmed[..unit].trim().parse().map_err(|_| wrong())?;
    match Duration::try_from_secs_f64(number * seconds) {
        Ok(span) if !span.is_zero() => Ok(span),
        _ => Err(wrong()),
    }
}

/// A number of threads.
pub(crate) fn threads(text: &str) -> Result<usize, String> {
    match text.trim().parse::<usize>() {
        Ok(n) if (1..=MOST_THREADS).contains(&n) => Ok(n),
        _ => Err(format!("--threads {text}: give a whole number from 1 to {MOST_THREADS}")),
    }
}

/// Bytes from `512MB`, `2GB`, `1.5GiB`.
pub(crate) fn memory(text: &str) -> Result<u64, String> {
    let wrong = || format!("--memory {text}: that is no size; write 512MB or 2GB");
    let trimmed = text.trim();
    let unit = trimmed.find(|c: char| c.is_ascii_alphabetic()).ok_or_else(wrong)?;
    let factor = match trimmed[unit..].to_ascii_lowercase().as_str() {
        "kb" => 1e3,
        "mb" => 1e6,
        "gb" => 1e9,
        "kib" => 1024.0,
        "mib" => 1_048_576.0,
        "gib" => 1_073_741_824.0,
        _ => return Err(wrong()),
    };
    let bytes = factor * trimmed[..unit].trim().parse::<f64>().map_err(|_| wrong())?;
    if (1e6..=1e15).contains(&bytes) { Ok(bytes as u64) } else { Err(format!("{}; at least 1MB", wrong())) }
}

/// One number, or three with commas between.
fn colour(text: &str) -> Option<Rgb> {
    let numbers: Option<Vec<f64>> =
        text.split(',').map(|n| n.trim().parse().ok().filter(|x: &f64| x.is_finite())).collect();
    match numbers?[..] {
        [grey] => Some(Rgb::grey(grey)),
        [r, g, b] => Some(Rgb([r, g, b])),
        _ => None,
    }
}

/// A material and a colour from `MATERIAL=r,g,b`.
pub(crate) fn painted(flag: &str, text: &str) -> Result<(String, Rgb), String> {
    let wrong = || format!("{flag} {text}: write MATERIAL=r,g,b or MATERIAL=grey");
    // names may hold '='
    let (name, value) = text.rsplit_once('=').ok_or_else(wrong)?;
    Ok((name.to_owned(), colour(value).ok_or_else(wrong)?))
}

/// A panel from `at=x,y,z:size=w,d:radiance=r,g,b:facing=x,y,z`.
pub(crate) fn panel(text: &str) -> Result<Panel, String> {
    let wrong = |what: String| format!("--light {text}: {what}; write at=x,y,z:size=w,d:radiance=r,g,b:facing=x,y,z");
    let (mut at, mut size, mut radiance, mut facing) = (None, None, None, None);
    for part in text.split(':') {
        let (key, value) = part.split_once('=').ok_or_else(|| wrong(format!("'{part}' is not name=value")))?;
        let numbers: Option<Vec<f64>> =
            value.split(',').map(|n| n.trim().parse().ok().filter(|x: &f64| x.is_finite())).collect();
        let numbers = numbers.ok_or_else(|| wrong(format!("'{value}' holds what is no number")))?;
        let point = || match numbers[..] {
            [x, y, z] => Ok(DVec3::new(x, y, z)),
            _ => Err(wrong(format!("'{value}' is not three numbers"))),
        };
        let twice = match key.trim() {
            "at" => at.replace(point()?).is_some(),
            "facing" => facing.replace(point()?).is_some(),
            "size" => {
                let edges = match numbers[..] {
                    [edge] => [edge, edge],
                    [w, d] => [w, d],
                    _ => return Err(wrong(format!("size '{value}' is not one or two numbers"))),
                };
                if edges.iter().any(|e| *e <= 0.0) {
                    return Err(wrong(format!("size '{value}' is not above 0")));
                }
                size.replace(edges).is_some()
            }
            "radiance" => {
                let value =
                    colour(value).ok_or_else(|| wrong(format!("radiance '{value}' is not one or three numbers")))?;
                radiance.replace(value).is_some()
            }
            other => return Err(wrong(format!("there is no '{other}'"))),
        };
        if twice {
            return Err(wrong(format!("'{key}' is given twice")));
        }
    }
    let missing = |name: &str| wrong(format!("'{name}' is missing"));
    let facing = facing.unwrap_or(DVec3::NEG_Y);
    if facing.length() == 0.0 {
        return Err(wrong("facing 0,0,0 is no direction".into()));
    }
    Ok(Panel {
        at: at.ok_or_else(|| missing("at"))?,
        size: size.ok_or_else(|| missing("size"))?,
        radiance: radiance.ok_or_else(|| missing("radiance"))?,
        facing,
    })
}

/// A camera as asked for; which way is up is the scene's business unless said.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct CameraRequest {
    pub(crate) eye: DVec3,
    pub(crate) at: DVec3,
    pub(crate) up: Option<DVec3>,
    pub(crate) fov: f64,
}

/// Field of view where none is given.
const FOV: f64 = 40.0;

/// A camera from `eye=x,y,z:at=x,y,z:fov=40`, in any order; `fov` may be left out, `up=x,y,z` added.
pub(crate) fn camera(text: &str) -> Result<CameraRequest, String> {
    let wrong = |what: String| format!("--camera {text}: {what}; write eye=x,y,z:at=x,y,z:fov=40");
    let (mut eye, mut at, mut up, mut fov) = (None, None, None, None);
    for part in text.split(':') {
        let (key, value) = part.split_once('=').ok_or_else(|| wrong(format!("'{part}' is not name=value")))?;
        let point = || -> Result<DVec3, String> {
            let numbers: Vec<f64> = value.split(',').map_while(|n| n.trim().parse().ok()).collect();
            match numbers[..] {
                [x, y, z] if value.split(',').count() == 3 && numbers.iter().all(|n| n.is_finite()) => {
                    Ok(DVec3::new(x, y, z))
                }
                _ => Err(wrong(format!("'{value}' is not three numbers"))),
            }
        };
        let twice = match key.trim() {
            "eye" => eye.replace(point()?).is_some(),
            "at" => at.replace(point()?).is_some(),
            "up" => up.replace(point()?).is_some(),
            "fov" => {
                let angle = value.trim().parse::<f64>().ok().filter(|a| *a > 0.0 && *a < 180.0);
                let angle = angle.ok_or_else(|| wrong(format!("fov '{value}' is not an angle between 0 and 180")))?;
                fov.replace(angle).is_some()
            }
            other => return Err(wrong(format!("there is no '{other}'"))),
        };
        if twice {
            return Err(wrong(format!("'{key}' is given twice")));
        }
    }
    let (Some(eye), Some(at)) = (eye, at) else {
        let missing = if eye.is_none() { "eye" } else { "at" };
        return Err(wrong(format!("'{missing}' is missing")));
    };
    if eye == at {
        return Err(wrong("eye and at are the same point".into()));
    }
    if up.is_some_and(|up| up.cross(at - eye).length() <= 1e-9 * up.length() * (at - eye).length()) {
        return Err(wrong("up lies along the view".into()));
    }
    Ok(CameraRequest { eye, at, up, fov: fov.unwrap_or(FOV) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_are_per_cent_with_or_without_the_sign() {
        for text in ["2%", "2", "2 %", " 2% "] {
            assert_eq!(percent(text), Ok(0.02), "{text}");
        }
        for text in ["", "%", "much", "NaN", "inf%", "1%%"] {
            assert!(percent(text).unwrap_err().contains("0.5%"), "{text}");
        }
    }

    #[test]
    fn times_need_a_unit() {
        assert_eq!(duration("500ms"), Ok(Duration::from_millis(500)));
        assert_eq!(duration("1.5 m"), Ok(Duration::from_secs(90)));
        for text in ["10", "s", "-3s", "0s", "1e999s", "3 weeks", "NaNs", "é"] {
            assert!(duration(text).unwrap_err().contains("500ms"), "{text}");
        }
    }

    #[test]
    fn panels_sizes_and_paints_are_read_or_refused_by_what_is_wrong() {
        let lamp = panel("at=1,2.5,-1:size=0.6,1.2:radiance=100").unwrap();
        assert_eq!((lamp.at, lamp.size, lamp.facing), (DVec3::new(1.0, 2.5, -1.0), [0.6, 1.2], DVec3::NEG_Y));
        for (text, said) in [
            ("size=1:radiance=1", "'at' is missing"),
            ("at=0,0,0:radiance=1", "'size' is missing"),
            ("at=0,0,0:size=1", "'radiance' is missing"),
            ("at=0,0:size=1:radiance=1", "three numbers"),
            ("at=0,0,0:size=0:radiance=1", "above 0"),
            ("at=0,0,NaN:size=1:radiance=1", "no number"),
            ("at=0,0,0:size=1:radiance=1,2", "radiance '1,2'"),
            ("at=0,0,0:size=1:radiance=1:facing=0,0,0", "no direction"),
            ("at=0,0,0:at=0,0,0:size=1:radiance=1", "twice"),
            ("watt=3", "no 'watt'"),
        ] {
            let found = panel(text).unwrap_err();
            assert!(found.contains(said) && found.contains("at=x,y,z"), "{text}: {found}");
        }
        assert_eq!(painted("--emission", "a=b=1,2,3"), Ok(("a=b".into(), Rgb([1.0, 2.0, 3.0]))));
        assert!(painted("--emission", "lamp").unwrap_err().contains("MATERIAL=r,g,b"));
        assert!(painted("--emission", "lamp=1,2").unwrap_err().contains("MATERIAL=r,g,b"));
        assert_eq!(memory("512MB"), Ok(512_000_000));
        for text in ["", "many", "12", "-1GB", "NaNGB", "1kB", "1e99GB"] {
            assert!(memory(text).unwrap_err().contains("2GB"), "{text}");
        }
    }

    #[test]
    fn threads_are_a_sane_number() {
        assert_eq!(threads("3"), Ok(3));
        for text in ["0", "-1", "many", "1025", "99999999999999999999", "1.5", ""] {
            assert!(threads(text).unwrap_err().contains("1 to 1024"), "{text}");
        }
    }

    #[test]
    fn cameras_are_read_in_any_order_and_refused_by_what_is_wrong() {
        let asked = camera("at=0,1,0:eye=-1,2.5,3e1:fov=55").unwrap();
        assert_eq!(asked.eye, DVec3::new(-1.0, 2.5, 30.0));
        assert_eq!((asked.at, asked.fov, asked.up), (DVec3::Y, 55.0, None));
        assert_eq!(camera("eye=1,0,0:at=0,0,0").unwrap().fov, 40.0);
        for (text, said) in [
            ("eye=1,2:at=0,0,0", "'1,2' is not three numbers"),
            ("eye=1,2,x:at=0,0,0", "three numbers"),
            ("eye=1,2,3,4:at=0,0,0", "three numbers"),
            ("eye=1,2,NaN:at=0,0,0", "three numbers"),
            ("at=0,0,0", "'eye' is missing"),
            ("eye=0,0,0", "'at' is missing"),
            ("eye=0,0,0:at=0,0,0", "same point"),
            ("eye=0,0,0:at=0,0,1:fov=180", "angle"),
            ("eye=0,0,0:at=0,0,1:zoom=2", "no 'zoom'"),
            ("eye=0,0,0:eye=0,0,0:at=0,0,1", "twice"),
            ("eye=0,0,0:at=0,0,1:up=0,0,2", "along the view"),
            ("", "name=value"),
        ] {
            let found = camera(text).unwrap_err();
            assert!(found.contains(said) && found.contains("eye=x,y,z"), "{text}: {found}");
        }
    }
}
