use ondelette_compress::*;
use ondelette_radiosity::kernel::LightKernel;
use ondelette_wavelet::cell::*;
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let scene = ondelette_io::read_scene(std::path::Path::new(&a[1]), &Default::default()).unwrap();
    let k = LightKernel::new(&scene);
    let basis = CellBasis::new(CellShape::Square, CellFamily::Multiwavelet, 1).unwrap();
    for r in 0..scene.sides.len().min(20) {
        for x in [[0.3, 0.2], [0.77, 0.6]] {
            let mut sum = 0.0;
            let mut usum = 0.0;
            let mut hidden = 0.0;
            for s in 0..scene.sides.len() {
                let (rc, sc) = (Cell::root(r as u32, CellShape::Square), Cell::root(s as u32, CellShape::Square));
                let Some(p) = k.pair(&rc, &sc) else { continue };
                let mut m = [0.0];
                p.moments(x, &basis, &mut m);
                usum += m[0];
                let v = if p.is_masked() { p.mask(x, &basis, &mut m, 4096, 7) } else { 1.0 };
                sum += m[0];
                if v == 0.0 {
                    hidden += m[0];
                }
            }
            // rays
            let e = k.element(&Cell::root(r as u32, CellShape::Square));
            let (n, t) = (k.sides()[r].normal, k.sides()[r].edges[0].normalize());
            let b = n.cross(t);
            let mut front = 0;
            let mut back = 0;
            let mut esc = 0;
            for i in 0..4096 {
                let u = (i as f64 + 0.5) / 4096.0;
                let phi = i as f64 * 2.399963;
                let d = n * (1.0 - u).sqrt() + (t * phi.cos() + b * phi.sin()) * u.sqrt();
                match k.occluders().first_hit(e.point(x), d, Some(k.sides()[r].patch)) {
                    None => esc += 1,
                    Some(h) if h.front => front += 1,
                    _ => back += 1,
                }
            }
            println!(
                "side {r} {x:?} sum {sum:.4} unocc {usum:.4} hidden {hidden:.4} rays front {:.4} back {:.4} esc {:.4}",
                front as f64 / 4096.0,
                back as f64 / 4096.0,
                esc as f64 / 4096.0
            );
        }
    }
}
