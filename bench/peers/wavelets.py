#!/usr/bin/env python3
"""PyWavelets beside ondelette-wavelet on the same cases, in the same minute.

    python3 bench/peers/wavelets.py

Makes a virtual environment under target/peers, installs numpy and PyWavelets from PyPI, builds the Rust benchmark, and
prints CPU-time throughput (one thread, best run) of both and their ratio. Full pyramids: every level that PyWavelets
accepts for the shape down to 2 coefficients on an axis.
"""
import os
import subprocess
import sys
import venv

ROOT = os.path.abspath(os.path.join(os.path.dirname(__file__), "..", ".."))
ENV = os.path.join(ROOT, "target", "peers")
PYTHON = os.path.join(ENV, "bin", "python")


def rust():
    out = subprocess.run(
        ["cargo", "bench", "-q", "-p", "ondelette-wavelet", "--bench", "transforms", "--", "--csv"],
        cwd=ROOT, check=True, capture_output=True, text=True).stdout
    rows = [line.split(",") for line in out.splitlines() if line.count(",") == 3]
    return {(name, kind): (float(up), float(down)) for name, kind, up, down in rows}


def peers():
    import time
    import warnings
    import numpy as np
    import pywt
    warnings.filterwarnings("ignore")
    h = np.array([1, 4, 6, 4, 1]) / 8 / 2 ** 0.5
    hd = np.array([-5, 20, -1, -96, 70, 280, 70, -96, -1, 20, -5]) / 256 * 2 ** 0.5
    # One even length for all four, as PyWavelets wants: 12 taps, both centred at tap 5 or 6.
    rec_lo, dec_lo = np.zeros(12), np.zeros(12)
    dec_lo[0:11] = hd
    rec_lo[4:9] = h
    sign = (-1.0) ** np.arange(12)
    bank = pywt.Wavelet("cubic44", filter_bank=[dec_lo, rec_lo * sign, rec_lo, -dec_lo * sign])
    cases = [
        ("bspline-periodic-2d", bank, "periodization", (4096, 4096)),
        ("bspline-mirror-2d", bank, "reflect", (4097, 4097)),
        ("haar-2d", pywt.Wavelet("haar"), "periodization", (4096, 4096)),
        ("d4-2d", pywt.Wavelet("db2"), "periodization", (4096, 4096)),
        ("cdf97-2d", pywt.Wavelet("bior4.4"), "periodization", (4096, 4096)),
        ("bspline-periodic-1d", bank, "periodization", (1 << 20,)),
    ]
    rng = np.random.default_rng(1)
    for name, wavelet, mode, shape in cases:
        for kind in ("f64", "f32"):
            x = rng.standard_normal(shape).astype(np.float64 if kind == "f64" else np.float32)
            level = int(np.ceil(np.log2(min(shape) - 1)))
            up = down = float("inf")
            for _ in range(3 if len(shape) == 2 else 20):
                t0 = time.process_time()
                c = pywt.wavedec2(x, wavelet, mode, level) if len(shape) == 2 else pywt.wavedec(x, wavelet, mode, level)
                t1 = time.process_time()
                y = pywt.waverec2(c, wavelet, mode) if len(shape) == 2 else pywt.waverec(c, wavelet, mode)
                t2 = time.process_time()
                up, down = min(up, t1 - t0), min(down, t2 - t1)
            assert y.dtype == x.dtype
            if mode == "periodization":
                worst = float(np.abs(y - x).max())
                assert worst < (1e-8 if kind == "f64" else 1e-2), (name, worst)
            n = x.size / 1e6
            print(f"{name},{kind},{n / up:.2f},{n / down:.2f}", flush=True)


def main():
    if "--peers" in sys.argv:
        return peers()
    if not os.path.exists(PYTHON):
        venv.create(ENV, with_pip=True)
        subprocess.run([PYTHON, "-m", "pip", "install", "-q", "numpy", "PyWavelets"], check=True)
    subprocess.run(["cargo", "bench", "-q", "-p", "ondelette-wavelet", "--bench", "transforms", "--no-run"],
                   cwd=ROOT, check=True)
    environment = dict(os.environ, OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1")
    out = subprocess.run([PYTHON, os.path.abspath(__file__), "--peers"], check=True, capture_output=True, text=True,
                         env=environment).stdout
    theirs = {tuple(line.split(",")[:2]): [float(v) for v in line.split(",")[2:]] for line in out.splitlines()}
    ours = rust()
    print(f"{'case':<22}{'type':>5}{'ours up':>10}{'theirs':>9}{'ratio':>8}{'ours down':>11}{'theirs':>9}{'ratio':>8}")
    for key, (up, down) in theirs.items():
        a, b = ours[key]
        print(f"{key[0]:<22}{key[1]:>5}{a:>10.0f}{up:>9.1f}{a / up:>8.1f}{b:>11.0f}{down:>9.1f}{b / down:>8.1f}")
    print("Msamples per CPU second, one thread, best run")


if __name__ == "__main__":
    main()
