//! Cloth falling over a ball, once, to find a natural shape for a draped sheet.
//!
//! Position-based dynamics (Müller et al., "Position Based Dynamics", 2007): points with Verlet steps, distances
//! restored one after the other. Only +, *, / and sqrt, in a fixed order: the same bits on every run.

use glam::{Vec2, Vec3};

/// A sheet of `columns` x `rows` points, row by row.
pub struct Sheet {
    /// Points in a row.
    pub columns: usize,
    /// Rows.
    pub rows: usize,
    /// Distance between neighbours at rest.
    pub spacing: f32,
    /// Where the points are.
    pub points: Vec<Vec3>,
}

/// What the sheet falls on: a ball standing on the floor y = 0.
#[derive(Clone, Copy, Debug)]
pub struct Ball {
    /// Radius; the centre is at (0, radius, 0).
    pub radius: f32,
    /// The sheet keeps this distance from ball and floor.
    pub skin: f32,
}

/// Two points and their distance at rest.
struct Tie {
    ends: [usize; 2],
    length: f32,
    stiffness: f32,
}

/// A level sheet above the ball, turned by `turn` radians and shifted, let fall for `steps` steps.
pub fn drape(mut sheet: Sheet, ball: Ball, steps: usize) -> Sheet {
    let ties = ties(&sheet);
    let mut before = sheet.points.clone();
    let gravity = Vec3::new(0.0, -0.006 * sheet.spacing, 0.0);
    for _ in 0..steps {
        for (p, last) in sheet.points.iter_mut().zip(&mut before) {
            let velocity = 0.97 * (*p - *last);
            *last = *p;
            *p += velocity + gravity;
        }
        // To and fro, so that the order of the ties does not push the sheet to one side.
        for _ in 0..6 {
            for tie in ties.iter().chain(ties.iter().rev()) {
                restore(&mut sheet.points, tie);
            }
        }
        for (p, last) in sheet.points.iter_mut().zip(&mut before) {
            collide(p, last, ball);
        }
    }
    sheet
}

/// A level sheet of points centred at `centre`, its rows turned by `turn` radians about the vertical.
pub fn level_sheet(columns: usize, rows: usize, spacing: f32, centre: Vec3, turn: f32) -> Sheet {
    let middle = 0.5 * Vec2::new((columns - 1) as f32, (rows - 1) as f32);
    let axis = Vec2::from_angle(turn);
    let points = (0..columns * rows)
        .map(|k| {
            let at = Vec2::new((k % columns) as f32, (k / columns) as f32) - middle;
            let at = spacing * axis.rotate(at);
            centre + Vec3::new(at.x, 0.0, -at.y)
        })
        .collect();
    Sheet {
        columns,
        rows,
        spacing,
        points,
    }
}

/// Neighbours, diagonals (shear) and second neighbours (bending).
fn ties(sheet: &Sheet) -> Vec<Tie> {
    let mut ties = Vec::new();
    let reaches = [
        (1, 0, 1.0),
        (0, 1, 1.0),
        (1, 1, 0.35),
        (1, -1, 0.35),
        (2, 0, 0.06),
        (0, 2, 0.06),
    ];
    for j in 0..sheet.rows as i32 {
        for i in 0..sheet.columns as i32 {
            for (di, dj, stiffness) in reaches {
                let (k, l) = (i + di, j + dj);
                let inside =
                    (0..sheet.columns as i32).contains(&k) && (0..sheet.rows as i32).contains(&l);
                if inside {
                    let index = |i: i32, j: i32| j as usize * sheet.columns + i as usize;
                    ties.push(Tie {
                        ends: [index(i, j), index(k, l)],
                        length: sheet.spacing * ((di * di + dj * dj) as f32).sqrt(),
                        stiffness,
                    });
                }
            }
        }
    }
    ties
}

fn restore(points: &mut [Vec3], tie: &Tie) {
    let [a, b] = tie.ends;
    let apart = points[b] - points[a];
    let distance = apart.length().max(1e-6);
    let pull = 0.5 * tie.stiffness * (1.0 - tie.length / distance) * apart;
    points[a] += pull;
    points[b] -= pull;
}

/// Out of the ball and the floor, with friction on both.
fn collide(p: &mut Vec3, last: &mut Vec3, ball: Ball) {
    let centre = Vec3::new(0.0, ball.radius, 0.0);
    let reach = ball.radius + ball.skin;
    let out = *p - centre;
    if out.length_squared() < reach * reach {
        *p = centre + reach * out.normalize_or(Vec3::Y);
        *last = last.lerp(*p, 0.9);
    }
    if p.y < ball.skin {
        p.y = ball.skin;
        *last = last.lerp(*p, 0.7);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fallen_sheet_keeps_its_size_and_stays_outside() {
        let ball = Ball {
            radius: 0.6,
            skin: 0.02,
        };
        let start = level_sheet(13, 17, 0.15, Vec3::new(0.0, 1.4, 0.0), 0.3);
        let sheet = drape(start, ball, 300);
        for (k, p) in sheet.points.iter().enumerate() {
            assert!(p.y >= 0.019);
            assert!(p.distance(Vec3::new(0.0, 0.6, 0.0)) >= 0.619);
            if k % 13 > 0 {
                let stretch = p.distance(sheet.points[k - 1]) / 0.15;
                assert!((0.7..1.25).contains(&stretch), "{stretch}");
            }
        }
        assert!(sheet.points.iter().any(|p| p.y < 0.3));
    }
}
