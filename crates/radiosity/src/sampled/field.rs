//! The light that rays read.

use super::gather::MOST;
use super::rays::Ray;
use ondelette_compress::forest::Node;
use ondelette_compress::{Forest, NodeId};
use ondelette_wavelet::cell::CellShape;

/// A radiosity at the leaves.
pub(super) struct Field<'a> {
    pub(super) forest: &'a Forest,
    coefficients: &'a [[f64; 3]],
    /// See [`bilinear`].
    bilinear: &'a [Form],
}

/// `a + b s + c t + d s t`, in the form in which rays read it fastest; rounding is far below scatter.
pub(super) type Form = [[f32; 3]; 4];

/// The form of coefficients on each leaf, for bases up to the second order; empty for others. Cost linear in the nodes.
pub(super) fn bilinear(forest: &Forest, coefficients: &[[f64; 3]], out: &mut Vec<Form>) {
    out.clear();
    let bases = [CellShape::Square, CellShape::Triangle].map(|shape| forest.basis(shape));
    if !bases.iter().all(|b| b.is_nested() && b.order() <= 2) {
        return;
    }
    // each function by its values at three or four corners
    let forms = bases.map(|basis| {
        let at = |x: [f64; 2]| {
            let mut values = [0.0; MOST];
            basis.eval(x, &mut values);
            values
        };
        let [o, s, t, st] = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]].map(at);
        let square = if basis.shape() == CellShape::Square { 1.0 } else { 0.0 };
        let form = |i: usize| [o[i], s[i] - o[i], t[i] - o[i], square * (st[i] - s[i] - t[i] + o[i])];
        (0..basis.len()).map(form).collect::<Vec<[f64; 4]>>()
    });
    let stride = forest.stride();
    let form = |(node, own): (&Node, &[[f64; 3]])| {
        let mut sum = [[0.0; 3]; 4];
        if node.first_child == 0 {
            let forms = &forms[usize::from(node.cell.shape == CellShape::Triangle)];
            for (form, c) in forms.iter().zip(own) {
                for (o, f) in sum.iter_mut().zip(form) {
                    (0..3).for_each(|k| o[k] += f * c[k]);
                }
            }
        }
        sum.map(|of| of.map(|v| v as f32))
    };
    out.reserve_exact(forest.len());
    out.extend(forest.nodes().iter().zip(coefficients.chunks(stride)).map(form));
}

impl<'a> Field<'a> {
    /// Coefficients at the leaves and their [`bilinear`] forms.
    pub(super) fn new(forest: &'a Forest, coefficients: &'a [[f64; 3]], bilinear: &'a [Form]) -> Self {
        Field { forest, coefficients, bilinear }
    }

    /// What a ray meets.
    pub(super) fn met(&self, ray: &Ray) -> [f64; 3] {
        let leaf = ray.leaf();
        if leaf == Ray::NO_LEAF {
            return [0.0; 3];
        }
        let [s, t] = ray.to();
        if let Some([a, b, c, d]) = self.bilinear.get(leaf as usize) {
            let [s, t] = [s, t].map(|x| x as f32);
            let st = s * t;
            return std::array::from_fn(|k| f64::from(a[k] + b[k] * s + c[k] * t + d[k] * st));
        }
        let basis = self.forest.basis(self.forest.node(NodeId(leaf)).cell.shape);
        let mut values = [0.0; MOST];
        basis.eval([s, t], &mut values);
        let own = &self.coefficients[leaf as usize * self.forest.stride()..][..basis.len()];
        let mut sum = [0.0; 3];
        for (c, v) in own.iter().zip(&values) {
            (0..3).for_each(|k| sum[k] += c[k] * v);
        }
        sum
    }
}
