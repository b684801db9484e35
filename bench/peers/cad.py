#!/usr/bin/env python3
"""STEP and IGES files of ondelette, read back by Open CASCADE.

    python3 bench/peers/cad.py

Makes a virtual environment under target/peers, installs numpy, scipy and cadquery-ocp-novtk (Open CASCADE) from PyPI,
writes documents of curves and surfaces, lets `ondelette edit` turn them into .step and .igs, reads those with Open
CASCADE, and compares 2000 points each with SciPy's evaluation of the documents. Prints the largest distance relative to
the size of the shape; exit code 1 if one is above 1e-12.
"""
import json
import math
import os
import subprocess
import sys
import tempfile
import venv

ROOT = os.path.abspath(os.path.join(os.path.dirname(__file__), "..", ".."))
ENV = os.path.join(ROOT, "target", "peers")
PYTHON = os.path.join(ENV, "bin", "python")
NEEDS = ["numpy", "scipy", "cadquery-ocp-novtk"]
LIMIT = 1e-12


def documents():
    """Name, document: control points without symmetry."""
    def wave(i, j=0):
        return [i + math.sin(2.1 * i + j), j + math.cos(1.3 * i), math.sin(0.7 * i * (j + 1))]

    def curve(boundary, spans, count, dim):
        points = [wave(i)[:dim] for i in range(count)]
        return {"kind": "curve", "boundary": boundary, "spans": spans, "domain": [0.25, 2.0], "points": points}

    def surface(boundaries, spans, counts):
        points = [[wave(i, j) for j in range(counts[1])] for i in range(counts[0])]
        return {"kind": "surface", "boundary": boundaries, "spans": spans, "points": points}

    return {
        "open_curve": curve("open", 13, 16, 3),
        "plane_curve": curve("open", 7, 10, 2),
        "closed_curve": curve("periodic", 12, 12, 3),
        "mirrored_curve": curve("mirror", 8, 9, 3),
        "sheet": surface(["open", "open"], [6, 9], [9, 12]),
        "tube": surface(["open", "periodic"], [5, 8], [8, 8]),
        "torus": surface(["periodic", "periodic"], [8, 6], [8, 6]),
    }


def basis(boundary, spans, domain, t):
    """Rows of basis values of one direction by SciPy, a column a control point."""
    import numpy as np
    from scipy.interpolate import BSpline
    u = (t - domain[0]) / (domain[1] - domain[0]) * spans
    if boundary == "open":
        knots = np.concatenate([[0.0] * 3, np.arange(spans + 1.0), [float(spans)] * 3])
        return BSpline.design_matrix(np.clip(u, 0, spans), knots, 3).toarray()
    knots = np.arange(-3.0, spans + 4.0)
    full = BSpline.design_matrix(np.clip(u, 0, spans), knots, 3).toarray()
    count = spans if boundary == "periodic" else spans + 1
    out = np.zeros((len(u), count))
    for k in range(full.shape[1]):
        i = k - 1
        i = i % spans if boundary == "periodic" else abs(i) if i <= spans else 2 * spans - i
        out[:, i] += full[:, k]
    return out


def reference(doc, s, t=None):
    import numpy as np
    points = np.array(doc["points"], dtype=float)
    if doc["kind"] == "curve":
        p = basis(doc["boundary"], doc["spans"], doc["domain"], s) @ points
        return np.hstack([p, np.zeros((len(s), 3 - p.shape[1]))])
    a = basis(doc["boundary"][0], doc["spans"][0], [0, 1], s)
    b = basis(doc["boundary"][1], doc["spans"][1], [0, 1], t)
    return np.einsum("ki,kj,ijc->kc", a, b, points)


def geometry(path, surface):
    """The spline of a file, as Open CASCADE reads it."""
    from OCP.BRep import BRep_Tool
    from OCP.IFSelect import IFSelect_RetDone
    from OCP.IGESControl import IGESControl_Reader
    from OCP.Interface import Interface_Static
    from OCP.STEPControl import STEPControl_Reader
    from OCP.TopAbs import TopAbs_EDGE, TopAbs_FACE
    from OCP.TopExp import TopExp_Explorer
    from OCP.TopoDS import TopoDS
    reader = STEPControl_Reader() if path.endswith(".step") else IGESControl_Reader()
    if reader.ReadFile(path) != IFSelect_RetDone:
        raise RuntimeError("not read")
    reader.TransferRoots()
    explorer = TopExp_Explorer(reader.OneShape(), TopAbs_FACE if surface else TopAbs_EDGE)
    if not explorer.More():
        raise RuntimeError("nothing in it")
    down = lambda name: getattr(TopoDS, name + "_s", None) or getattr(TopoDS, name)
    if surface:
        return BRep_Tool.Surface_s(down("Face")(explorer.Current()))
    found = BRep_Tool.Curve_s(down("Edge")(explorer.Current()), 0.0, 0.0)
    return found[0] if isinstance(found, tuple) else found


def check():
    import numpy as np
    program = os.path.join(ROOT, "target", "release", "ondelette")
    failed = False
    print(f"{'shape':<16}{'file':<8}{'largest distance / size':>24}")
    with tempfile.TemporaryDirectory() as folder:
        for name, doc in documents().items():
            source = os.path.join(folder, name + ".json")
            with open(source, "w") as f:
                json.dump(doc, f)
            outputs = [os.path.join(folder, name + e) for e in (".step", ".igs")]
            subprocess.run([program, "edit", source, "-o", outputs[0], "-o", outputs[1]], check=True)
            surface = doc["kind"] == "surface"
            rng = np.random.default_rng(7)
            for path in outputs:
                shape = geometry(path, surface)
                if surface:
                    s, t = rng.random(2000), rng.random(2000)
                    p = [shape.Value(float(a), float(b)) for a, b in zip(s, t)]
                else:
                    a, b = doc["domain"]
                    s, t = a + (b - a) * rng.random(2000), None
                    p = [shape.Value(float(x)) for x in s]
                p = np.array([[q.X(), q.Y(), q.Z()] for q in p])
                want = reference(doc, s, t)
                worst = np.abs(p - want).max() / np.ptp(want, axis=0).max()
                failed |= not worst <= LIMIT
                print(f"{name:<16}{os.path.splitext(path)[1]:<8}{worst:>24.2e}")
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    if "--inside" in sys.argv:
        check()
    if not os.path.exists(PYTHON):
        venv.create(ENV, with_pip=True)
    subprocess.run([PYTHON, "-m", "pip", "install", "-q", *NEEDS], check=True)
    subprocess.run(["cargo", "build", "-q", "--release", "-p", "ondelette"], cwd=ROOT, check=True)
    sys.exit(subprocess.run([PYTHON, __file__, "--inside"]).returncode)
