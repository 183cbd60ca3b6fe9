//! Pages of whole numbers: columns of codes, leaves and other nodes each in their own.

use super::{
    bounds,
    bytes::{Cursor, Put},
    column::{Columns, Planes},
    octahedron,
    quantise::{Axes, Before, Code, Shape},
};
use crate::{
    hierarchy::{MOST_CHILDREN, Node},
    splat::Splat,
};
use glam::DVec3;

/// The codes of the splats of a page, and the shapes behind those of its inner nodes.
pub struct Codes {
    begin: Before,
    codes: Vec<Code>,
    pub shapes: Vec<Shape>,
}

/// Replaces the splats of a page by those that will be read, and gives leaves their bounds. `None` where a splat has no
/// code; the nodes may be changed then.
pub fn quantise(nodes: &mut [Node], extent: f32) -> Option<Codes> {
    let normals: DVec3 = nodes.iter().filter_map(|node| octahedron::unpacked(node.splat.normal)).sum();
    let begin = Before {
        facing: octahedron::facing(normals),
        strength: nodes.iter().map(|node| node.splat.strength).find(|&strength| strength > 0.0).unwrap_or(1.0),
        center: nodes[0].splat.center,
        normal: [0; 2],
        color: [0; 3],
        direction: None,
    };
    let mut before = begin;
    let mut codes = Vec::with_capacity(nodes.len());
    let mut shapes = Vec::new();
    for node in nodes {
        let (code, splat, shape) = Code::encode(&node.splat, node.is_leaf(), &mut before)?;
        node.splat = splat;
        if node.is_leaf() {
            bounds::leaf(node, &shape, extent);
        } else {
            shapes.push(shape);
        }
        codes.push(code);
    }
    Some(Codes { begin, codes, shapes })
}

/// One quantity of some codes.
type Take = fn(&Code) -> i32;

/// Those of all nodes but whose order follows: axes first, as they tell which others a node has.
const SHAPE: [Take; 3] = [|code| code.sigma, |code| code.ratio, |code| code.thickness];
const ANGLE: [Take; 1] = [|code| code.angle];
const TURN: [Take; 4] = [|code| code.turn[0], |code| code.turn[1], |code| code.turn[2], |code| code.turn[3]];
const NORMAL: [Take; 2] = [|code| code.normal[0], |code| code.normal[1]];
const REST: [Take; 8] = [
    |code| code.position[0],
    |code| code.position[1],
    |code| code.position[2],
    |code| code.color[0],
    |code| code.color[1],
    |code| code.color[2],
    |code| code.color[3],
    |code| code.strength,
];

/// The page's bytes; `bounds` are those of its inner nodes.
pub fn encode(nodes: &[Node], codes: &Codes, bounds: &[bounds::Code], out: &mut Vec<u8>) {
    out.push(codes.begin.facing);
    out.f32s(&[codes.begin.strength]);
    out.f32s(&codes.begin.center);
    let mut columns = Columns::default();
    columns.push(&nodes.iter().map(|node| node.children as i32).collect::<Vec<_>>());
    for is_leaf in [true, false] {
        let some = nodes.iter().zip(&codes.codes).filter(|(node, _)| node.is_leaf() == is_leaf).map(|(_, code)| *code);
        let some: Vec<Code> = some.collect();
        let mut push = |which: &dyn Fn(&Code) -> bool, takes: &[Take]| {
            for take in takes {
                columns.push(&some.iter().filter(|code| which(code)).map(take).collect::<Vec<_>>());
            }
        };
        push(&|_| true, &[|code| code.axes as i32]);
        push(&|_| true, &SHAPE);
        push(&|code| code.axes == Axes::Normal, &ANGLE);
        push(&|code| code.axes != Axes::Normal, &TURN);
        push(&|code| code.axes != Axes::Bare, &NORMAL);
        push(&|_| true, &REST);
    }
    let mut push = |take: &dyn Fn(&bounds::Code) -> i32| columns.push(&bounds.iter().map(take).collect::<Vec<_>>());
    (0..3).for_each(|axis| push(&|code| code.center[axis]));
    push(&|code| code.radius);
    push(&|code| code.cone);
    push(&|code| code.size);
    columns.finish(out);
}

/// The columns of leaves or of inner nodes, ready to be taken one by one.
struct Group {
    axes: Vec<Axes>,
    shape: [Vec<i32>; 3],
    angle: std::vec::IntoIter<i32>,
    turn: [std::vec::IntoIter<i32>; 4],
    normal: [std::vec::IntoIter<i32>; 2],
    rest: [Vec<i32>; 8],
    at: usize,
}

impl Group {
    fn read(planes: &mut Planes, count: usize) -> Result<Self, String> {
        let axes: Option<Vec<Axes>> = planes.column(count)?.into_iter().map(Axes::of).collect();
        let axes = axes.ok_or("the axes of a node are none")?;
        let of = |which: &dyn Fn(Axes) -> bool| axes.iter().filter(|&&axes| which(axes)).count();
        let [flat, normal] = [of(&|axes| axes == Axes::Normal), of(&|axes| axes != Axes::Bare)];
        Ok(Self {
            shape: columns(planes, count)?,
            angle: planes.column(flat)?.into_iter(),
            turn: columns(planes, count - flat)?.map(Vec::into_iter),
            normal: columns(planes, normal)?.map(Vec::into_iter),
            rest: columns(planes, count)?,
            axes,
            at: 0,
        })
    }

    fn next(&mut self) -> Option<Code> {
        let at = self.at;
        self.at += 1;
        let axes = *self.axes.get(at)?;
        let [sigma, ratio, thickness] = [0, 1, 2].map(|i| self.shape[i][at]);
        let rest = |i: usize| self.rest[i][at];
        let mut code = Code {
            axes,
            sigma,
            ratio,
            thickness,
            angle: 0,
            turn: [0; 4],
            normal: [0; 2],
            position: [rest(0), rest(1), rest(2)],
            color: [rest(3), rest(4), rest(5), rest(6)],
            strength: rest(7),
        };
        match axes {
            Axes::Normal => code.angle = self.angle.next()?,
            Axes::Own | Axes::Bare => {
                for (part, column) in code.turn.iter_mut().zip(&mut self.turn) {
                    *part = column.next()?;
                }
            }
        }
        if axes != Axes::Bare {
            for (part, column) in code.normal.iter_mut().zip(&mut self.normal) {
                *part = column.next()?;
            }
        }
        Some(code)
    }
}

fn columns<const N: usize>(planes: &mut Planes, count: usize) -> Result<[Vec<i32>; N], String> {
    let mut out = [const { Vec::new() }; N];
    for column in &mut out {
        *column = planes.column(count)?;
    }
    Ok(out)
}

/// The nodes of a page of `count`.
pub fn decode(bytes: &[u8], count: usize, first_child: u32, extent: f32) -> Result<Vec<Node>, String> {
    let mut cursor = Cursor::new(bytes);
    let mut begin = || Some((cursor.u8()?, cursor.f32()?, cursor.f32s()?));
    let (facing, strength, center) = begin().ok_or("it ends within its beginning")?;
    if facing >= 6 {
        return Err(format!("it faces the unknown axis {facing}"));
    }
    let mut before = Before { facing, strength, center, normal: [0; 2], color: [0; 3], direction: None };
    let mut planes = Planes::new(cursor.take(cursor.remaining()).unwrap_or(&[]))?;
    let children = planes.column(count)?;
    if let Some(odd) = children.iter().find(|&&children| !(0..=MOST_CHILDREN as i32).contains(&children)) {
        return Err(format!("a node has {odd} children"));
    }
    let leaves = children.iter().filter(|&&children| children == 0).count();
    let mut groups = [Group::read(&mut planes, leaves)?, Group::read(&mut planes, count - leaves)?];
    let bounds: [Vec<i32>; 6] = columns(&mut planes, count - leaves)?;
    planes.end()?;
    let mut next = first_child;
    let mut inner = 0;
    let mut nodes = Vec::with_capacity(count);
    for children in children {
        let is_leaf = children == 0;
        let fail = || format!("node {} has a code that tells of none", nodes.len());
        let code = groups[usize::from(!is_leaf)].next().ok_or_else(fail)?;
        let (splat, shape) = code.decode(is_leaf, &mut before).ok_or_else(fail)?;
        let mut node = blank(splat);
        if is_leaf {
            bounds::leaf(&mut node, &shape, extent);
        } else {
            let [x, y, z, radius, cone, size] = [0, 1, 2, 3, 4, 5].map(|i| bounds[i][inner]);
            inner += 1;
            let code = bounds::Code { center: [x, y, z], radius, cone, size };
            code.decode(&mut node, &shape, extent).ok_or_else(fail)?;
            (node.first_child, node.children) = (next, children as u32);
            next = next.checked_add(children as u32).ok_or("it has more children than can be numbered")?;
        }
        nodes.push(node);
    }
    Ok(nodes)
}

/// A node of which only the splat is known.
fn blank(splat: Splat) -> Node {
    Node { splat, center: splat.center, radius: 0.0, size: 0.0, cone: 0.0, first_child: 0, children: 0 }
}
