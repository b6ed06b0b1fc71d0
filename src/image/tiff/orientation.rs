//! Orientation: where the first row and column of the file are in the picture.

use super::Fault;

/// Which way the rows of the file lie in the picture (TIFF 6.0, section 8).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Orientation {
    /// The first sample of a row is at the right; of transposed pictures, the first row.
    mirrored: bool,
    /// The first row is at the bottom; of transposed pictures, the first sample of a row.
    flipped: bool,
    /// Rows of the file are columns.
    transposed: bool,
}

impl Orientation {
    /// By the number in the file; unknown ones are the usual.
    pub fn of(number: u64) -> Self {
        let (mirrored, flipped) = match number {
            2 | 6 => (true, false),
            3 | 7 => (true, true),
            4 | 8 => (false, true),
            _ => (false, false),
        };
        Self {
            mirrored,
            flipped,
            transposed: (5..=8).contains(&number),
        }
    }

    /// Width and height of the picture by those of the rows in the file.
    pub fn size(self, (width, height): (usize, usize)) -> (usize, usize) {
        match self.transposed {
            true => (height, width),
            false => (width, height),
        }
    }

    /// The picture, from the left and top, of pixels as they lie in the file.
    pub fn apply<T: Copy>(
        self,
        samples: Vec<T>,
        (width, height): (usize, usize),
    ) -> Result<Vec<T>, Fault> {
        if self == Self::of(1) {
            return Ok(samples);
        }
        let per_pixel = samples.len() / (width * height);
        let mut picture = Vec::new();
        picture
            .try_reserve_exact(samples.len())
            .map_err(|_| Fault::broken("no memory to turn its pixels"))?;
        let (across, down) = self.size((width, height));
        for y in 0..down {
            let y = if self.flipped { down - 1 - y } else { y };
            for x in 0..across {
                let x = if self.mirrored { across - 1 - x } else { x };
                let pixel = match self.transposed {
                    true => x * width + y,
                    false => y * width + x,
                };
                picture.extend_from_slice(&samples[pixel * per_pixel..][..per_pixel]);
            }
        }
        Ok(picture)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_row_and_column_come_to_where_the_number_says() {
        // Rows of the file: 1 2 3 / 4 5 6.
        let turned = |number| {
            let orientation = Orientation::of(number);
            let picture = orientation.apply(vec![1, 2, 3, 4, 5, 6], (3, 2)).unwrap();
            (orientation.size((3, 2)), picture)
        };
        assert_eq!(turned(1), ((3, 2), vec![1, 2, 3, 4, 5, 6]));
        assert_eq!(turned(2), ((3, 2), vec![3, 2, 1, 6, 5, 4]));
        assert_eq!(turned(3), ((3, 2), vec![6, 5, 4, 3, 2, 1]));
        assert_eq!(turned(4), ((3, 2), vec![4, 5, 6, 1, 2, 3]));
        // First row at the left, first sample on top; then right and top, right and bottom, left and bottom.
        assert_eq!(turned(5), ((2, 3), vec![1, 4, 2, 5, 3, 6]));
        assert_eq!(turned(6), ((2, 3), vec![4, 1, 5, 2, 6, 3]));
        assert_eq!(turned(7), ((2, 3), vec![6, 3, 5, 2, 4, 1]));
        assert_eq!(turned(8), ((2, 3), vec![3, 6, 2, 5, 1, 4]));
        assert_eq!(turned(99), turned(1));
    }

    #[test]
    fn pixels_stay_whole() {
        let turned = Orientation::of(3).apply(vec![1, 2, 3, 4], (2, 1));
        assert_eq!(turned.unwrap(), [3, 4, 1, 2]);
    }
}
