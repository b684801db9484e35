//! Scratch driver.
use ondelette_radiosity::*;
use std::time::Instant;
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let scene = ondelette_io::read_scene(std::path::Path::new(&a[1]), &Default::default()).unwrap();
    let settings = Settings { basis: a[2].parse().unwrap(), error: a[3].parse::<f64>().unwrap() / 100.0 };
    let t = Instant::now();
    let mut s = Solver::new(scene, settings).unwrap();
    while let Some(e) = s.step() {
        if let Event::Solved { error, links, elements } = e {
            println!(
                "{:7.2}s error {:.3}% links {links} elements {elements} its {} rays {}",
                t.elapsed().as_secs_f64(),
                error * 100.0,
                s.solution().statistics().iterations,
                s.solution().statistics().rays
            );
        }
        if t.elapsed().as_secs_f64() > 150.0 {
            println!("timeout");
            break;
        }
    }
    let sol = s.solution();
    let t2 = Instant::now();
    let led = ondelette_radiosity::ledger::Ledger::count(&sol, 1 << 20);
    println!("ledger closure {:+.5} emitted {:?} in {:.2}s", led.closure(), led.emitted, t2.elapsed().as_secs_f64());
    let t2 = Instant::now();
    let cam = sol.scene().camera.unwrap_or_else(|| ondelette_radiosity::view::frame_from_inside(sol.scene()));
    let img = ondelette_radiosity::view::render(&sol, &cam, 640, 480);
    let tm = ondelette_io::write::ToneMap::auto(&img);
    let px: Vec<[u8; 3]> = img.iter().map(|p| tm.encode(*p)).collect();
    ondelette_io::write::write_png(std::path::Path::new("/tmp/o.png"), 640, 480, &px).unwrap();
    println!("camera {cam:?} {:.2}s", t2.elapsed().as_secs_f64());
    println!("{:.2}s", t.elapsed().as_secs_f64());
    if let Some(r) = a.get(4) {
        // compare against the reference
        let text = std::fs::read_to_string(r).unwrap();
        let k: usize = a.get(5).map_or(4, |k| k.parse().unwrap());
        let (mut num, mut den, mut sgn) = (0.0, 0.0, 0.0);
        let mut per: std::collections::BTreeMap<usize, (f64, f64)> = Default::default();
        for line in text.lines().skip(2) {
            let f: Vec<f64> = line.split(',').map(|x| x.parse().unwrap()).collect();
            if f[16] != 0.0 {
                continue;
            }
            let o = glam::DVec3::new(f[4], f[5], f[6]);
            let u = glam::DVec3::new(f[7], f[8], f[9]);
            let v = glam::DVec3::new(f[10], f[11], f[12]);
            let n = glam::DVec3::new(f[13], f[14], f[15]);
            let mut got = Rgb::BLACK;
            let side = f[0] as usize;
            for i in 0..k {
                for j in 0..k {
                    let p = o + u * ((i as f64 + 0.5) / k as f64) + v * ((j as f64 + 0.5) / k as f64);
                    let (so, su, sv) = sol.scene().frame(sol.scene().sides[side]);
                    assert!(su.cross(sv).normalize().dot(n) > 0.99);
                    let d = p - so;
                    let nn = su.cross(sv);
                    let at = [sv.cross(nn).dot(d) / nn.length_squared(), nn.cross(su).dot(d) / nn.length_squared()];
                    got += sol.irradiance(side, at) * (1.0 / (k * k) as f64);
                }
            }
            for c in 0..3 {
                num += f[3] * (got.0[c] - f[17 + c]).abs();
                den += f[3] * f[17 + c];
                sgn += f[3] * (got.0[c] - f[17 + c]);
                let p = per.entry(side).or_default();
                p.0 += f[3] * (got.0[c] - f[17 + c]).abs();
                p.1 += f[3] * f[17 + c];
            }
        }
        println!("rel_l1 {:.5} bias {:+.5}", num / den, sgn / den);
        let mut v: Vec<_> = per.into_iter().collect();
        v.sort_by(|a, b| b.1.0.total_cmp(&a.1.0));
        for (s, (e, w)) in v.into_iter().take(4) {
            println!("   side {s}: {:.1}% of error, own {:.4}", 100.0 * e / num, e / w);
        }
    }
}
