//! From linear light to the 8-bit sRGB of a screen.

/// A tone curve: exposure, then Reinhard's global operator with a white point.
///
/// With L the luminance (Rec. 709 weights) times `exposure` and W = `white`, the displayed luminance is
/// L (1 + L / W^2) / (1 + L): equation 4 of Reinhard, Stark, Shirley and Ferwerda, *Photographic Tone Reproduction for
/// Digital Images*, 2002. L = W becomes white; W = 1 leaves L as it is; a large W keeps every highlight. Colours keep
/// their ratios and are clamped to [0, 1] channel by channel.
///
/// ```
/// use ondelette_io::write::ToneMap;
/// let plain = ToneMap { exposure: 1.0, white: 1.0 };
/// assert_eq!(plain.encode([1.0, 1.0, 1.0]), [255, 255, 255]);
/// assert_eq!(plain.encode([0.5, 0.5, 0.5]), [188, 188, 188]);
/// assert_eq!(plain.encode([0.0, -1.0, 0.0]), [0, 0, 0]);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ToneMap {
    /// Factor on every channel before the curve.
    pub exposure: f64,
    /// Exposed luminance that is shown as white, at least 1.
    pub white: f64,
}

/// Luminance of linear sRGB (Rec. 709 primaries).
fn luminance(linear: [f32; 3]) -> f64 {
    0.2126 * f64::from(linear[0]) + 0.7152 * f64::from(linear[1]) + 0.0722 * f64::from(linear[2])
}

/// Grey to which the log-average luminance is exposed (the "key" of the same paper, section 3.1).
const KEY: f64 = 0.18;

impl ToneMap {
    /// The curve for a picture: its log-average luminance (black and non-finite pixels left out) becomes middle grey
    /// 0.18, and the brightest hundredth of the lit pixels becomes white.
    ///
    /// Depends on the multiset of pixels alone, but for rounding in the mean; a black picture gets exposure 1. Cost
    /// O(n log n) for n pixels.
    ///
    /// ```
    /// use ondelette_io::write::ToneMap;
    /// let dim = ToneMap::auto(&[[0.02, 0.02, 0.02]; 4]);
    /// assert!((dim.exposure - 9.0).abs() < 1e-6);
    /// ```
    pub fn auto(pixels: &[[f32; 3]]) -> Self {
        let mut lit: Vec<f64> = pixels
            .iter()
            .map(|&p| luminance(p))
            .filter(|l| l.is_finite() && *l > f64::from(f32::MIN_POSITIVE))
            .collect();
        if lit.is_empty() {
            return ToneMap { exposure: 1.0, white: 1.0 };
        }
        let log_mean = lit.iter().map(|l| l.ln()).sum::<f64>() / lit.len() as f64;
        let exposure = KEY / log_mean.exp();
        lit.sort_by(f64::total_cmp);
        let bright = lit[(lit.len() - 1) * 99 / 100];
        ToneMap { exposure, white: (bright * exposure).max(1.0) }
    }

    /// Linear light to linear display values in [0, 1]: what a viewer that encodes to sRGB itself (vertex colours of an
    /// unlit glTF material) should be given. Negative channels and NaN become 0.
    pub fn display(&self, linear: [f32; 3]) -> [f32; 3] {
        let positive = linear.map(|c| if c > 0.0 { c.min(f32::MAX) } else { 0.0 });
        let exposed = luminance(positive) * self.exposure;
        let curve = (1.0 + exposed / (self.white * self.white)) / (1.0 + exposed);
        positive.map(|c| (f64::from(c) * self.exposure * curve).clamp(0.0, 1.0) as f32)
    }

    /// Linear light to 8-bit sRGB.
    pub fn encode(&self, linear: [f32; 3]) -> [u8; 3] {
        self.display(linear).map(|c| (255.0 * srgb(f64::from(c))).round() as u8)
    }
}

/// The sRGB transfer function (IEC 61966-2-1) on [0, 1].
fn srgb(linear: f64) -> f64 {
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_room_under_another_lamp_looks_the_same() {
        let room: Vec<[f32; 3]> = (0..1000).map(|i| [0.1 + 0.001 * i as f32, 0.3, 0.2]).collect();
        let bright: Vec<[f32; 3]> = room.iter().map(|p| p.map(|c| 1024.0 * c)).collect();
        let (a, b) = (ToneMap::auto(&room), ToneMap::auto(&bright));
        for (p, q) in room.iter().zip(&bright) {
            assert_eq!(a.encode(*p), b.encode(*q));
        }
    }

    #[test]
    fn a_black_background_and_a_lamp_do_not_drown_the_room() {
        let mut picture = vec![[0.2f32, 0.2, 0.2]; 1000];
        picture.extend(vec![[0.0f32; 3]; 4000]);
        picture.extend(vec![[500.0f32; 3]; 5]);
        let tone = ToneMap::auto(&picture);
        let wall = tone.encode([0.2, 0.2, 0.2])[0];
        assert!((90..150).contains(&wall), "wall shown as {wall}");
        assert_eq!(tone.encode([500.0; 3]), [255; 3]);
        assert_eq!(tone.encode([0.0; 3]), [0; 3]);
    }

    #[test]
    fn brighter_is_never_darker_and_white_is_white() {
        let tone = ToneMap { exposure: 0.5, white: 4.0 };
        assert!((tone.display([8.0; 3])[0] - 1.0).abs() < 1e-6);
        let steps: Vec<u8> = (0..2000).map(|i| tone.encode([0.01 * i as f32; 3])[0]).collect();
        assert!(steps.windows(2).all(|w| w[0] <= w[1]));
    }

    #[test]
    fn odd_pixels_give_a_picture_not_a_panic() {
        let odd = [[f32::NAN; 3], [f32::INFINITY; 3], [-1.0; 3], [f32::MAX; 3]];
        let tone = ToneMap::auto(&odd);
        assert!(tone.exposure.is_finite() && tone.white.is_finite());
        assert_eq!(tone.encode(odd[0]), [0; 3]);
        assert_eq!(tone.encode(odd[2]), [0; 3]);
        assert_eq!(ToneMap::auto(&[]).exposure, 1.0);
    }
}
