#!/usr/bin/env python3
"""Two ways to get the same irradiance by random walks, beside ondelette, on the same scenes in the same minute.

    python3 bench/peers/light.py [scene ...]          cornell and two_room

Makes a virtual environment under target/peers-light, installs Mitsuba 3 (BSD-3) and numpy from PyPI, builds ondelette, and lights
the scenes of bench/scenes with

  ondelette     `ondelette light --error p%` for 5, 2 and 1 %
  particles     light particles traced from the lamps, their power deposited on the cells of the reference (Mitsuba's rays; the
                walk and the deposit are written here)
  paths         Mitsuba's path integrator from random points of every cell, with direct light sampled at the point itself

For each: CPU seconds (user + system of all threads), wall seconds, and the error of the cell means against the reference, with the
reference's own noise taken off in quadrature. The last two columns say what a random walk needs for 2 and 1 %: its error falls with
the root of the work. Mitsuba compiles its kernels with LLVM, 17 or newer: that of rustc is taken unless DRJIT_LIBLLVM_PATH says
another.
"""
import csv
import glob
import math
import os
import resource
import subprocess
import sys
import tempfile
import time
import venv

ROOT = os.path.abspath(os.path.join(os.path.dirname(__file__), "..", ".."))
ENV = os.path.join(ROOT, "target", "peers-light")
PYTHON = os.path.join(ENV, "bin", "python")
PROGRAM = os.path.join(ROOT, "target", "release", "ondelette")
SCENES = os.path.join(ROOT, "bench", "scenes")
POINTS = 4  # probed points of a cell along an axis


def cpu(who):
    usage = resource.getrusage(who)
    return usage.ru_utime + usage.ru_stime


class Reference:
    """Cells with known mean irradiance, those of pure emitters left out."""

    def __init__(self, name):
        with open(os.path.join(SCENES, name + ".csv")) as f:
            self.noise = float(f.readline().rsplit(":", 1)[1])
            self.rows = list(csv.DictReader(f))
        self.cells = [r for r in self.rows if r["emitter"] == "0"]
        self.steps = {}  # cells of each quad along its two edges
        for r in self.rows:
            i, j = self.steps.get(int(r["quad"]), (0, 0))
            self.steps[int(r["quad"])] = (max(i, int(r["i"]) + 1), max(j, int(r["j"]) + 1))

    def error(self, irradiance):
        """Relative L1 of a function from (quad, i, j) to three numbers, without the reference's noise."""
        off = whole = 0.0
        for r in self.cells:
            got = irradiance(int(r["quad"]), int(r["i"]), int(r["j"]))
            for channel, value in zip("rgb", got):
                off += float(r["area"]) * abs(value - float(r["E_" + channel]))
                whole += float(r["area"]) * float(r["E_" + channel])
        return math.sqrt(max(0.0, (off / whole) ** 2 - self.noise ** 2))


def vector(row, name):
    return [float(row[name + axis]) for axis in "xyz"]


def ondelette(name, reference):
    for percent in (5, 2, 1):
        with tempfile.TemporaryDirectory() as folder:
            onl, points, values = (os.path.join(folder, x) for x in ("a.onl", "p.csv", "v.csv"))
            before, start = cpu(resource.RUSAGE_CHILDREN), time.time()
            done = subprocess.run([PROGRAM, "light", os.path.join(SCENES, name + ".obj"), "--error", f"{percent}%", "-o", onl],
                                  capture_output=True)
            seconds, wall = cpu(resource.RUSAGE_CHILDREN) - before, time.time() - start
            if done.returncode > 1:
                sys.exit(done.stderr.decode())
            with open(points, "w") as f:
                for r in reference.cells:
                    o, u, v, n = (vector(r, x) for x in "ouvn")
                    for k in range(POINTS * POINTS):
                        s, t = (k % POINTS + 0.5) / POINTS, (k // POINTS + 0.5) / POINTS
                        p = [o[d] + s * u[d] + t * v[d] for d in range(3)]
                        f.write(",".join(map(repr, p + n)) + "\n")
            subprocess.run([PROGRAM, "probe", onl, points, "-o", values], check=True)
            with open(values) as f:
                rows = [[float(r["irradiance_" + c]) for c in "rgb"] for r in csv.DictReader(f)]
        k = POINTS * POINTS
        means = {(int(r["quad"]), int(r["i"]), int(r["j"])): [sum(x[c] for x in rows[m * k:(m + 1) * k]) / k for c in range(3)]
                 for m, r in enumerate(reference.cells)}
        show(name, f"ondelette {percent} %", seconds, wall, reference.error(lambda q, i, j: means[q, i, j]), False)


def show(name, method, seconds, wall, error, random):
    needs = "".join(f"{seconds * (error / goal) ** 2:9.2f}" for goal in (0.02, 0.01)) if random else ""
    print(f"{name:<10} {method:<22} {seconds:8.2f} {wall:8.2f} {100 * error:8.2f} % {needs}", flush=True)


def read_obj(name):
    """Quads in file order: four corners, reflectance, radiance."""
    materials, vertices, quads, current = {}, [], [], None
    with open(os.path.join(SCENES, name + ".mtl")) as f:
        for word, *rest in (line.split() for line in f if line.strip()):
            if word == "newmtl":
                material = materials.setdefault(rest[0], {"Kd": [0, 0, 0], "Ke": [0, 0, 0]})
            elif word in ("Kd", "Ke"):
                material[word] = [float(x) for x in rest]
    with open(os.path.join(SCENES, name + ".obj")) as f:
        for word, *rest in (line.split() for line in f if line.strip()):
            if word == "v":
                vertices.append([float(x) for x in rest[:3]])
            elif word == "usemtl":
                current = materials[rest[0]]
            elif word == "f":
                quads.append(([vertices[int(x.split("/")[0]) - 1] for x in rest], current["Kd"], current["Ke"]))
    return quads


def walks(names):
    import drjit as dr
    import mitsuba as mi
    import numpy as np
    mi.set_variant("llvm_ad_rgb")

    def build(quads):
        """A mesh a quad. Its texture coordinates are (number of the quad + s, t), so a hit knows where it is."""
        scene = {"type": "scene"}
        for k, (corners, kd, ke) in enumerate(quads):
            mesh = mi.Mesh(f"q{k}", 4, 2, has_vertex_texcoords=True, props=properties(kd, ke))
            params = mi.traverse(mesh)
            params["vertex_positions"] = np.ravel(corners).astype(np.float32)
            params["faces"] = np.array([0, 1, 2, 0, 2, 3], dtype=np.uint32)
            params["vertex_texcoords"] = np.array([k, 0, k + 1, 0, k + 1, 1, k, 1], dtype=np.float32)
            params.update()
            scene[f"q{k}"] = mesh
        return mi.load_dict(scene)

    def properties(kd, ke):
        props = mi.Properties()
        props["bsdf"] = mi.load_dict({"type": "diffuse", "reflectance": {"type": "rgb", "value": kd}})
        if max(ke) > 0:
            props["emitter"] = mi.load_dict({"type": "area", "radiance": {"type": "rgb", "value": ke}})
        return props

    def table(array):
        return mi.Float(np.ascontiguousarray(array, dtype=np.float32))

    for name in names:
        reference, quads = Reference(name), read_obj(name)
        scene = build(quads)
        corners = np.array([q[0] for q in quads])
        edges = [corners[:, 1] - corners[:, 0], corners[:, 3] - corners[:, 0]]
        area = np.linalg.norm(np.cross(*edges), axis=1)
        kd, ke = np.array([q[1] for q in quads]), np.array([q[2] for q in quads])
        steps = np.array([reference.steps[k] for k in range(len(quads))])
        first = np.concatenate([[0], np.cumsum(steps.prod(axis=1))])
        rho = [table(kd[:, c]) for c in range(3)]
        columns, rows, offset = (mi.UInt32(x.astype(np.uint32)) for x in (steps[:, 0], steps[:, 1], first[:-1]))
        cell_area = np.repeat(area / steps.prod(axis=1), steps.prod(axis=1))
        total = int(first[-1])

        # which edge of a quad its first index runs along is for the reference to say
        swapped = np.zeros(len(quads), dtype=bool)
        for r in reference.rows:
            k = int(r["quad"])
            u = np.array(vector(r, "u"))
            swapped[k] = abs(u @ edges[1][k]) > abs(u @ edges[0][k])
        turned = mi.Bool(swapped)

        def where(si):
            quad = mi.UInt32(dr.clip(dr.floor(si.uv.x), 0, len(quads) - 1))
            s, t = dr.clip(si.uv.x - mi.Float(quad), 0, 0.999999), dr.clip(si.uv.y, 0, 0.999999)
            turn = dr.gather(mi.Bool, turned, quad)
            s, t = dr.select(turn, t, s), dr.select(turn, s, t)
            nx, ny = dr.gather(mi.UInt32, columns, quad), dr.gather(mi.UInt32, rows, quad)
            cell = dr.gather(mi.UInt32, offset, quad) + mi.UInt32(s * nx) * ny + mi.UInt32(t * ny)
            return quad, cell

        def particles(count, seed):
            lamps = np.flatnonzero(ke.max(axis=1) > 0)
            power = math.pi * ke[lamps] * area[lamps, None]
            share = power.sum(axis=1) / power.sum()
            sampler = mi.load_dict({"type": "independent"})
            sampler.seed(seed, count)
            pick = sampler.next_1d()
            lamp = dr.zeros(mi.UInt32, count)
            for edge in np.cumsum(share)[:-1]:
                lamp += dr.select(pick >= float(edge), 1, 0)
            get = lambda x: dr.gather(mi.Float, table(x), lamp)
            s, t = sampler.next_1d(), sampler.next_1d()
            o, u, v = corners[lamps, 0], edges[0][lamps], edges[1][lamps]
            point = mi.Point3f(*[get(o[:, d]) + s * get(u[:, d]) + t * get(v[:, d]) for d in range(3)])
            normals = np.cross(u, v) / area[lamps, None]
            frame = mi.Frame3f(mi.Normal3f(*[get(normals[:, d]) for d in range(3)]))
            weight = mi.Color3f(*[get(power[:, c] / share) / count for c in range(3)])
            si = dr.zeros(mi.SurfaceInteraction3f, count)
            si.p, si.n, si.sh_frame = point, frame.n, frame
            ray = si.spawn_ray(frame.to_world(mi.warp.square_to_cosine_hemisphere(sampler.next_2d())))
            sums = [dr.zeros(mi.Float, total) for _ in range(3)]
            bounce = 0
            while True:
                si = scene.ray_intersect(ray)
                active = si.is_valid() & (si.wi.z > 0)
                quad, cell = where(si)
                for c in range(3):
                    dr.scatter_reduce(dr.ReduceOp.Add, sums[c], weight[c], cell, active)
                colour = mi.Color3f(*[dr.gather(mi.Float, rho[c], quad, active) for c in range(3)])
                survival = dr.max(colour)
                active &= sampler.next_1d() < survival
                weight = weight * colour / dr.maximum(survival, 1e-9)
                ray = si.spawn_ray(si.to_world(mi.warp.square_to_cosine_hemisphere(sampler.next_2d())))
                dr.eval(sums, active, weight, ray)
                # those that go on
                alive = dr.compress(active)
                left = dr.width(alive)
                if left == 0:
                    break
                ray, weight = dr.gather(mi.Ray3f, ray, alive), dr.gather(mi.Color3f, weight, alive)
                bounce += 1
                sampler = mi.load_dict({"type": "independent"})
                sampler.seed(seed + 1000 * bounce, left)
            return np.stack([np.array(x) for x in sums], axis=1) / cell_area[:, None]

        index = {}
        for r in reference.rows:
            k, i, j = (int(r[x]) for x in ("quad", "i", "j"))
            index[k, i, j] = first[k] + i * steps[k][1] + j

        def paths(count, seed):
            integrator = mi.load_dict({"type": "path", "max_depth": -1, "rr_depth": 3, "hide_emitters": True})
            order = [index[int(r["quad"]), int(r["i"]), int(r["j"])] for r in reference.cells]
            each = [np.array([vector(r, x) for r in reference.cells]) for x in "ouvn"]
            n = len(order) * count
            sampler = mi.load_dict({"type": "independent"})
            sampler.seed(seed, n)
            cell = dr.arange(mi.UInt32, n) // count
            get = lambda x, d: dr.gather(mi.Float, table(x[:, d]), cell)
            s, t = sampler.next_1d(), sampler.next_1d()
            si = dr.zeros(mi.SurfaceInteraction3f, n)
            si.p = mi.Point3f(*[get(each[0], d) + s * get(each[1], d) + t * get(each[2], d) for d in range(3)])
            si.n = mi.Normal3f(*[get(each[3], d) for d in range(3)])
            si.sh_frame = mi.Frame3f(si.n)
            ray = si.spawn_ray(si.to_world(mi.warp.square_to_cosine_hemisphere(sampler.next_2d())))
            light = integrator.sample(scene, sampler, ray)[0] * math.pi
            ds, weight = scene.sample_emitter_direction(si, sampler.next_2d(), True)
            light += weight * dr.maximum(0, dr.dot(ds.d, si.n))
            means = np.zeros((total, 3))
            for c in range(3):
                means[order, c] = np.array(light[c]).reshape(len(order), count).mean(axis=1)
            return means

        for method, trace, count in (("particles", particles, 1 << 21), ("paths", paths, 64)):
            trace(count, 2)  # its kernels are compiled once, before the clock
            before, start = cpu(resource.RUSAGE_SELF), time.time()
            found = trace(count, 2)
            seconds, wall = cpu(resource.RUSAGE_SELF) - before, time.time() - start
            # where a cell is lit, the reference counts exitance in the scene's own unit, as ondelette does
            error = reference.error(lambda q, i, j: found[index[q, i, j]])
            show(name, f"{method} {count}", seconds, wall, error, True)


def main():
    names = [a for a in sys.argv[1:] if not a.startswith("-")] or ["cornell", "two_room"]
    if "--walks" in sys.argv:
        walks(names)
        return
    if not os.path.exists(PYTHON):
        venv.create(ENV, with_pip=True)
        subprocess.run([PYTHON, "-m", "pip", "install", "-q", "mitsuba", "numpy"], check=True)
    subprocess.run(["cargo", "build", "-q", "--release", "-p", "ondelette"], cwd=ROOT, check=True)
    print(f"{'scene':<10} {'method':<22} {'CPU s':>8} {'wall s':>8} {'error':>8}   {'s for 2 %':>9} {'1 %':>8}")
    for name in names:
        ondelette(name, Reference(name))
    sysroot = subprocess.run(["rustc", "--print", "sysroot"], check=True, capture_output=True, text=True).stdout.strip()
    llvm = sorted(glob.glob(os.path.join(sysroot, "lib", "libLLVM.so*")))
    environment = {"DRJIT_LIBLLVM_PATH": llvm[-1]} if llvm else {}
    subprocess.run([PYTHON, os.path.abspath(__file__), "--walks", *names], check=True, env={**environment, **os.environ})


if __name__ == "__main__":
    main()
