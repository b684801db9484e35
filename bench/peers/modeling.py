#!/usr/bin/env python3
"""CHOLMOD and SciPy's radial basis functions beside ondelette-modeling on the same problems.

    python3 bench/peers/modeling.py [solvers.csv]

Makes a virtual environment under target/peers, installs numpy, scipy and scikit-sparse (which wants Debian's
libsuitesparse-dev; without it CHOLMOD is left out), runs `cargo bench -p ondelette-modeling --bench solvers` (or reads
what it printed) and prints CPU seconds of one thread, medians, with ratios. Problems: thin plates through scattered
values (corners and a low-discrepancy sequence), the same numbers as in benches/solvers.rs.

CHOLMOD: the factor of H + rho A^T A and four rounds of multipliers; "warm" keeps the symbolic analysis, "values" the
factors. RBF: thin-plate splines with a linear part through the same points, evaluated on the grid: the same physics
without boundary (it does not yield a B-spline).
"""
import os
import subprocess
import sys
import venv

ROOT = os.path.abspath(os.path.join(os.path.dirname(__file__), "..", ".."))
ENV = os.path.join(ROOT, "target", "peers")
PYTHON = os.path.join(ENV, "bin", "python")
MASK = (1 << 64) - 1


def mix(key):
    z = (key + 0x9E3779B97F4A7C15) & MASK
    z = ((z ^ (z >> 30)) * 0xBF58476D1CE4E5B9) & MASK
    z = ((z ^ (z >> 27)) * 0x94D049BB133111EB) & MASK
    return z ^ (z >> 31)


def unit(key):
    return (mix(key) >> 11) / (1 << 53)


def combine(a, b):
    return mix(a ^ mix(b))


def rust(path):
    if path:
        out = open(path).read()
    else:
        command = ["cargo", "bench", "-q", "-p", "ondelette-modeling", "--bench", "solvers"]
        out = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True).stdout
    rows = [line.split(",") for line in out.splitlines() if line.count(",") == 3]
    return {r[0]: float(r[1]) for r in rows}


def peers(ours):
    import time
    import numpy as np
    import scipy.sparse as sp
    from scipy.interpolate import BSpline, RBFInterpolator
    try:
        from sksparse.cholmod import analyze, cholesky
    except ImportError:
        analyze = cholesky = None
        print("scikit-sparse is not there: CHOLMOD is left out")

    def median(runs, f):
        times = []
        for _ in range(runs):
            t = time.process_time()
            f()
            times.append(time.process_time() - t)
        return sorted(times)[len(times) // 2]

    def axis(boundary, n):
        """Mass, stretch, bend and a function t -> row of one axis."""
        if boundary == "open":
            knots = np.r_[[0] * 3, np.arange(n + 1), [n] * 3].astype(float)
            many = n + 3
        else:
            knots = np.arange(-3, n + 4).astype(float)
            many = n + 3
        x, w = np.polynomial.legendre.leggauss(4)
        points = (np.arange(n)[:, None] + (x + 1) / 2).ravel()
        weights = sp.diags(np.tile(w / 2, n))
        spline = BSpline(knots, np.eye(many), 3)
        fold = sp.identity(many, format="csr")
        if boundary == "mirrored":
            i = np.arange(many)
            j = np.abs(i - 1)
            fold = sp.csr_matrix((np.ones(many), (i, np.minimum(j, 2 * n - j))), shape=(many, n + 1))
        grams = []
        for a in range(3):
            b = sp.csr_matrix(spline(points, nu=a)) @ fold
            grams.append((b.T @ weights @ b).tocsr())
        return grams, lambda t: np.asarray(spline(t) @ fold)

    def problem(boundary, n, m):
        (m0, k1, k2), row = axis(boundary, n)
        h = sp.kron(k2, m0) + 2 * sp.kron(k1, k1) + sp.kron(m0, k2)
        g, q = 0.7548776662466927, 0.5698402909980533
        places = [[(i // 2) * n, (i % 2) * n] if i < 4 else [(0.5 + g * i) % 1 * n, (0.5 + q * i) % 1 * n]
                  for i in range(m)]
        p = np.array(places, float)
        s, t = row(p[:, 0]), row(p[:, 1])
        a = sp.csr_matrix(np.einsum("mi,mj->mij", s, t).reshape(m, -1)) if n <= 64 else sp.vstack(
            [sp.kron(sp.csr_matrix(s[i:i + 1]), sp.csr_matrix(t[i:i + 1])) for i in range(m)]).tocsr()
        b = np.array([unit(combine(1, i)) * 2 - 1 for i in range(m)])
        return h.tocsc(), a, b, p

    print(f"{'case':26}{'ours':>10}{'CHOLMOD':>10}{'warm':>10}{'values':>10}{'RBF':>10}  ratios to ours")
    cases = [("mirrored", 64, 64, "cold-refined", 5), ("mirrored", 256, 256, "cold-refined", 3),
             ("mirrored", 512, 1024, "cold-refined", 1), ("open", 64, 64, "bpx-1e-8", 5),
             ("open", 256, 256, "bpx-1e-8", 3)]
    for boundary, n, m, name, runs in cases:
        h, a, b, p = problem(boundary, n, m)
        rho = 1e3 * h.diagonal().max()
        k = (h + rho * (a.T @ a)).tocsc()

        def rest(factor):
            x, lam = 0, np.zeros(m)
            for _ in range(4):
                x = factor(a.T @ (rho * b + lam))
                lam = lam + rho * (b - a @ x)
            return x

        times = {}
        if analyze:
            times["CHOLMOD"] = median(runs, lambda: rest(cholesky(k)))
            symbolic = analyze(k)
            times["warm"] = median(runs, lambda: rest(symbolic.cholesky(k)))
            factor = cholesky(k)
            times["values"] = median(runs, lambda: rest(factor))
        grid = np.stack(np.meshgrid(np.arange(n + 1.0), np.arange(n + 1.0), indexing="ij"), -1).reshape(-1, 2)
        if n <= 256:
            times["RBF"] = median(runs, lambda: RBFInterpolator(p, b, kernel="thin_plate_spline", degree=1)(grid))
        key = f"{boundary}-{n}-{m}-{name}"
        own, values = ours.get(key, float("nan")), ours.get(f"{boundary}-{n}-{m}-values-refined", float("nan"))
        line = f"{key[:26]:26}{own * 1e3:10.2f}"
        for peer in ("CHOLMOD", "warm", "values", "RBF"):
            line += f"{times[peer] * 1e3:10.2f}" if peer in times else f"{'-':>10}"
        against = [f"{k} {v / (values if k == 'values' else own):.1f}" for k, v in times.items()]
        print(line + "  " + ", ".join(against) + "   (ms)", flush=True)


def main():
    if os.path.realpath(sys.prefix) != os.path.realpath(ENV):
        if not os.path.exists(PYTHON):
            venv.create(ENV, with_pip=True)
        subprocess.run([PYTHON, "-m", "pip", "install", "-q", "numpy", "scipy"], check=True)
        subprocess.run([PYTHON, "-m", "pip", "install", "-q", "scikit-sparse==0.4.16"], check=False)
        env = dict(os.environ, OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1")
        sys.exit(subprocess.run([PYTHON, os.path.abspath(__file__), *sys.argv[1:]], env=env).returncode)
    peers(rust(sys.argv[1] if len(sys.argv) > 1 else None))


if __name__ == "__main__":
    main()
