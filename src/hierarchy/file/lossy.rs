//! Lossy pages: columns of integer codes, separate for leaves and for inner nodes.

use super::{
    bounds,
    column::{Columns, Planes},
    quantise::{Axes, Before, Code, Shape},
};
use crate::container::{Cursor, Put};
use crate::{
    hierarchy::{MOST_CHILDREN, Node},
    splat::Splat,
};

/// The codes of a page's splats, and the decoded shapes of its inner nodes.
pub struct Codes {
    strength: f32,
    center: [f32; 3],
    leaves: Group,
    inner: Group,
    shapes: Vec<Shape>,
}

impl Codes {
    /// Returns the shapes of inner nodes, each with the code of its largest standard deviation.
    pub fn shapes(&self) -> impl Iterator<Item = (i32, Shape)> {
        self.inner.sigmas().iter().copied().zip(self.shapes.iter().copied())
    }
}

/// Replaces the splats of a page by their decoded values, and sets the bounds of leaves. `None` if
/// a splat has no code; the nodes may then be partly changed.
pub fn quantise(nodes: &mut [Node], extent: f32) -> Option<Codes> {
    let strength = nodes
        .iter()
        .map(|node| node.splat.strength)
        .find(|&strength| strength > 0.0)
        .unwrap_or(1.0);
    let center = nodes[0].splat.center;
    let leaves = nodes.iter().filter(|node| node.is_leaf()).count();
    let mut out = Codes {
        strength,
        center,
        leaves: Group::with_room(leaves),
        inner: Group::with_room(nodes.len() - leaves),
        shapes: Vec::with_capacity(nodes.len() - leaves),
    };
    let mut before = Before::new(strength, center);
    for node in nodes {
        let (code, splat, shape) = Code::encode(&node.splat, node.is_leaf(), &mut before)?;
        node.splat = splat;
        if node.is_leaf() {
            bounds::leaf(node, &shape, extent);
            out.leaves.push(&code);
        } else {
            out.shapes.push(shape);
            out.inner.push(&code);
        }
    }
    Some(out)
}

/// The codes of leaves or of inner nodes, in columns.
struct Group {
    /// Codes that every node has: axes, shape, position, colour, strength.
    all: [Vec<i32>; 12],
    /// For nodes with axes by their normal.
    angle: Vec<i32>,
    /// For nodes with other axes.
    turn: [Vec<i32>; 4],
    /// For nodes with a normal.
    normal: [Vec<i32>; 2],
}

/// The number of codes consumed from each kind of column.
#[derive(Default)]
struct Taken {
    all: usize,
    angle: usize,
    turn: usize,
    normal: usize,
}

impl Group {
    fn with_room(count: usize) -> Self {
        let room = || Vec::with_capacity(count);
        Self {
            all: std::array::from_fn(|_| room()),
            angle: room(),
            turn: [const { Vec::new() }; 4],
            normal: std::array::from_fn(|_| room()),
        }
    }

    fn push(&mut self, code: &Code) {
        let Code {
            axes,
            sigma,
            ratio,
            thickness,
            position: [x, y, z],
            color: [luma, orange, green, alpha],
            ..
        } = *code;
        let all = [
            axes as i32,
            sigma,
            ratio,
            thickness,
            x,
            y,
            z,
            luma,
            orange,
            green,
            alpha,
            code.strength,
        ];
        self.all.iter_mut().zip(all).for_each(|(column, value)| column.push(value));
        if axes == Axes::Normal {
            self.angle.push(code.angle);
        } else {
            self.turn.iter_mut().zip(code.turn).for_each(|(column, value)| column.push(value));
        }
        if axes != Axes::Bare {
            self.normal.iter_mut().zip(code.normal).for_each(|(column, value)| column.push(value));
        }
    }

    fn take(&self, taken: &mut Taken) -> Option<Code> {
        let mut all = [0; 12];
        for (value, column) in all.iter_mut().zip(&self.all) {
            *value = *column.get(taken.all)?;
        }
        let [axes, sigma, ratio, thickness, x, y, z, luma, orange, green, alpha, strength] = all;
        let axes = Axes::of(axes)?;
        let (mut angle, mut turn, mut normal) = (0, [0; 4], [0; 2]);
        taken.all += 1;
        if axes == Axes::Normal {
            angle = *self.angle.get(taken.angle)?;
            taken.angle += 1;
        } else {
            for (value, column) in turn.iter_mut().zip(&self.turn) {
                *value = *column.get(taken.turn)?;
            }
            taken.turn += 1;
        }
        if axes != Axes::Bare {
            for (value, column) in normal.iter_mut().zip(&self.normal) {
                *value = *column.get(taken.normal)?;
            }
            taken.normal += 1;
        }
        let (position, color) = ([x, y, z], [luma, orange, green, alpha]);
        Some(Code { axes, sigma, ratio, thickness, angle, turn, normal, position, color, strength })
    }

    /// Returns the codes of the largest standard deviations.
    fn sigmas(&self) -> &[i32] {
        &self.all[1]
    }

    fn columns(&self) -> impl Iterator<Item = &Vec<i32>> {
        self.all.iter().chain([&self.angle]).chain(&self.turn).chain(&self.normal)
    }

    fn read(planes: &mut Planes, count: usize) -> Result<Self, String> {
        let all: [Vec<i32>; 12] = columns(planes, count)?;
        let of = |which: Axes| all[0].iter().filter(|&&axes| axes == which as i32).count();
        let (flat, bare) = (of(Axes::Normal), of(Axes::Bare));
        let [angle] = columns(planes, flat)?;
        Ok(Self {
            all,
            angle,
            turn: columns(planes, count - flat)?,
            normal: columns(planes, count - bare)?,
        })
    }
}

fn columns<const N: usize>(planes: &mut Planes, count: usize) -> Result<[Vec<i32>; N], String> {
    let mut out = [const { Vec::new() }; N];
    for column in &mut out {
        *column = planes.column(count)?;
    }
    Ok(out)
}

/// Appends the bytes of a page; `bounds` are those of its inner nodes. The spheres of nodes are
/// fine if the code of their largest standard deviation is at least `fine`.
pub fn encode(
    nodes: &[Node],
    codes: &Codes,
    bounds: &[bounds::Code],
    fine: i32,
    out: &mut Vec<u8>,
) {
    out.f32s(&[codes.strength]);
    out.f32s(&codes.center);
    out.u32(fine as u32);
    let mut columns = Columns::default();
    let mut values: Vec<i32> = nodes.iter().map(|node| stored_children(node.children)).collect();
    columns.push(&values);
    codes.leaves.columns().chain(codes.inner.columns()).for_each(|column| columns.push(column));
    let finer = codes.inner.sigmas().iter().zip(bounds).filter(|&(&sigma, _)| sigma >= fine);
    let finer: Vec<bounds::Code> = finer.map(|(_, code)| *code).collect();
    let mut push = |bounds: &[bounds::Code], take: &dyn Fn(&bounds::Code) -> i32| {
        values.clear();
        values.extend(bounds.iter().map(take));
        columns.push(&values);
    };
    (0..3).for_each(|axis| push(&finer, &|code| code.center[axis]));
    push(bounds, &|code| code.radius);
    push(bounds, &|code| code.cone);
    push(bounds, &|code| code.size);
    columns.finish(out);
}

/// Returns the number of children as stored. The maximum, which is frequent, becomes a small
/// number.
fn stored_children(children: u32) -> i32 {
    if children == MOST_CHILDREN as u32 { -1 } else { children as i32 }
}

fn children(stored: i32) -> Option<u8> {
    match stored {
        -1 => Some(MOST_CHILDREN as u8),
        _ => u8::try_from(stored).ok().filter(|&children| usize::from(children) < MOST_CHILDREN),
    }
}

/// Decodes a page of `count` nodes.
pub fn decode(
    bytes: &[u8],
    count: usize,
    first_child: u32,
    extent: f32,
) -> Result<Vec<Node>, String> {
    let mut cursor = Cursor::new(bytes);
    let mut begin = || Some((cursor.f32()?, cursor.f32s()?, cursor.u32()? as i32));
    let (strength, center, fine) = begin().ok_or("it ends inside its first fields")?;
    let mut planes = Planes::new(cursor.take(cursor.remaining()).unwrap_or(&[]))?;
    let children: Option<Vec<u8>> = planes.column(count)?.into_iter().map(children).collect();
    let children = children.ok_or("a node has too many children")?;
    let leaves = children.iter().filter(|&&children| children == 0).count();
    let groups = [Group::read(&mut planes, leaves)?, Group::read(&mut planes, count - leaves)?];
    let finer = groups[1].sigmas().iter().filter(|&&sigma| sigma >= fine).count();
    let centers: [Vec<i32>; 3] = columns(&mut planes, finer)?;
    let [radius, cone, size] = columns(&mut planes, count - leaves)?;
    planes.end()?;
    let mut before = Before::new(strength, center);
    let mut taken = [Taken::default(), Taken::default()];
    let (mut inner, mut centered) = (0, 0);
    let mut next = first_child;
    let mut nodes = Vec::with_capacity(count);
    for children in children {
        let is_leaf = children == 0;
        let fail = || format!("the code of node {} is not valid", nodes.len());
        let group = usize::from(!is_leaf);
        let code = groups[group].take(&mut taken[group]).ok_or_else(fail)?;
        let (splat, shape) = code.decode(is_leaf, &mut before).ok_or_else(fail)?;
        let mut node = blank(splat);
        if is_leaf {
            bounds::leaf(&mut node, &shape, extent);
        } else {
            let step = bounds::fine_step(code.sigma, fine, extent);
            let center =
                [0, 1, 2].map(|axis| if step.is_some() { centers[axis][centered] } else { 0 });
            centered += usize::from(step.is_some());
            let code = bounds::Code {
                center,
                radius: radius[inner],
                cone: cone[inner],
                size: size[inner],
            };
            code.decode(&mut node, &shape, extent, step).ok_or_else(fail)?;
            inner += 1;
            (node.first_child, node.children) = (next, u32::from(children));
            next = next
                .checked_add(u32::from(children))
                .ok_or("it has more children than 32 bits can number")?;
        }
        nodes.push(node);
    }
    Ok(nodes)
}

/// A node with its splat only.
fn blank(splat: Splat) -> Node {
    Node {
        splat,
        center: splat.center,
        radius: 0.0,
        size: 0.0,
        cone: 0.0,
        first_child: 0,
        children: 0,
    }
}
