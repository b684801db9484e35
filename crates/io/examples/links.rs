//! Scratch.
use ondelette_compress::*;
use ondelette_radiosity::kernel::LightKernel;
use ondelette_radiosity::*;
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let scene = ondelette_io::read_scene(std::path::Path::new(&a[1]), &Default::default()).unwrap();
    let settings = Settings { basis: a[2].parse().unwrap(), error: a[3].parse::<f64>().unwrap() / 100.0 };
    let mut s = Solver::new(scene, settings).unwrap();
    while s.step().is_some() {}
    let sol = s.solution();
    let f = sol.forest();
    let k = LightKernel::new(sol.scene());
    let stride = f.stride();
    // radiosity values
    let mut b = vec![[0.0; 1]; f.len() * stride];
    for (n, node) in f.nodes().iter().enumerate() {
        if node.first_child == 0 {
            let m = sol.scene().material(sol.scene().sides[node.cell.root as usize]);
            for j in 0..stride {
                b[n * stride + j][0] = m.reflectance.0[1] * sol.coefficients()[n * stride + j][1];
            }
            b[n * stride][0] += m.radiance.0[1] * std::f64::consts::PI;
        }
    }
    transport::pull(f, &mut b);
    let mut groups: std::collections::BTreeMap<String, [f64; 4]> = Default::default();
    for (li, l) in s.solution().links().as_slice().iter().enumerate().step_by(7) {
        let cols = f.basis_of(l.shooter).truncated(l.orders[1] as usize);
        let block = &sol.links().blocks()[l.block as usize..];
        let got: f64 =
            cols.iter().enumerate().map(|(j, &c)| block[j] * b[l.shooter.index() * stride + c as usize][0]).sum();
        // truth
        let mut truth = 0.0;
        let n = 64;
        let rc = f.node(l.receiver).cell;
        let e = k.element(&rc);
        for i in 0..n {
            let x = e.point([(i as f64 * 0.754877666 + 0.1).fract(), (i as f64 * 0.569840 + 0.3).fract()]);
            let mut stack = vec![l.shooter];
            while let Some(id) = stack.pop() {
                if f.is_leaf(id) {
                    let (ff, v) =
                        k.visible_factor(x, e.normal(), &f.node(id).cell, (li * 1000 + i) as u64 * 7919 + id.0 as u64);
                    truth += ff * v * b[id.index() * stride][0] / n as f64;
                } else {
                    for c in 0..4 {
                        stack.push(f.child(id, c));
                    }
                }
            }
        }
        let w = f.node(l.receiver).measure;
        let lev = f.node(l.shooter).cell.depth;
        for key in [
            format!("masked {}", l.masked),
            format!("masked {} shooterdepth {lev} leaf {}", l.masked, f.is_leaf(l.shooter)),
            format!("orders {:?} masked {}", l.orders, l.masked),
            format!("rdepth {} masked {}", f.node(l.receiver).cell.depth, l.masked),
        ] {
            let g = groups.entry(key).or_default();
            g[0] += w * got;
            g[1] += w * truth;
            g[2] += w * (got - truth).abs();
            g[3] += 1.0;
        }
    }
    let all: f64 = groups.iter().filter(|(k, _)| *k == "masked true" || *k == "masked false").map(|(_, g)| g[1]).sum();
    for (k, g) in groups {
        println!(
            "{k:50} n {:6} share {:.4} rel diff {:+.5} of all {:+.5} abs {:.5}",
            g[3],
            g[1] / all,
            (g[0] - g[1]) / g[1],
            (g[0] - g[1]) / all,
            g[2] / all
        );
    }
}
