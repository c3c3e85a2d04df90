#!/usr/bin/env python3
"""Independent reference numbers for the calibration library.

    pip install mpmath numpy scipy && python3 tests/golden/generate.py

writes `kinematics.json` and `fit.json` beside this file. The files in the repository were made with Python 3.11.7,
mpmath 1.4.1, numpy 2.4.6, scipy 1.17.1. `kinematics.json` comes out the same to the bit everywhere. In `fit.json` the
inputs do too, but the results of the float64 linear algebra may differ in their last digits from one LAPACK to another.

Deliberately naive: full 4x4 matrix products, numerical differences, off-the-shelf least squares. It shares no code,
and no clever idea, with what it checks. The model and the data are those of the paper:

    T = L1 J1 L2 J2 ... LJ JJ L(J+1)        base frame to tool frame
    L = Trans(x, y, z) Rz(alpha) Ry(beta) Rx(gamma)
    J = Rz(theta) (revolute, "R") or Trans_z(theta) (prismatic, "P"),  theta = offset + scale * q
    d = |T s - c|                           sphere s in the tool frame, chuck c in the base frame

Parameters: x_i y_i z_i alpha_i beta_i gamma_i offset_i scale_i for i = 1..J, then the six of link J+1; metres, radians.
"""
import os

os.environ["OMP_NUM_THREADS"] = os.environ["OPENBLAS_NUM_THREADS"] = "1"  # one order of summation; before numpy loads

import json
import math
import pathlib
import random
import re

import numpy as np
from mpmath import mp, mpf
from scipy.optimize import least_squares

HERE = pathlib.Path(__file__).resolve().parent
mp.dps = 60  # 50 digits and a margin for the differences
STEP = mpf(10) ** -20  # central differences: truncation and rounding both stand near 1e-40

# Table II of the paper: (design, optimised), centimetres, degrees and 1. HELD: "held fixed", optimised = design.
HELD = None
TABLE_II = [  # x, y, z, alpha, beta, gamma, offset, scale
    [(0, 1.25885), (0, -0.192122), (66.04, 66.8858), (0, 0.0750332), (0, 0.0563741), (0, 0.142109),
     (-90, HELD), (1, 0.999217)],
    [(-18, -18.0803), (0, 0.0706535), (0, HELD), (90, HELD), (0, -0.277037), (-90, -90.0001), (0, HELD), (1, 1.0008)],
    [(43.18, 43.3215), (0, 0.639884), (-3.091, HELD), (0, HELD), (0, -0.137778), (0, -0.116512),
     (-90, HELD), (1, 1.00005)],
    [(43.307, 43.3068), (-2.032, -2.12003), (0, HELD), (90, HELD), (0, -0.0246447), (90, 90.0979),
     (0, HELD), (1, 0.998821)],
    [(0, -0.0109964), (0, -0.0434906), (0, HELD), (0, HELD), (0, -0.496135), (-90, -90.0111), (0, HELD), (1, 1.00053)],
    [(0, 0.00523043), (0, 0.0394295), (0, HELD), (0, HELD), (0, 3.18249), (90, 89.9855), (0, HELD), (1, 1.00016)],
    [(0, 0.00166565), (0, -0.00298551), (5.625, HELD), (0, HELD), (0, -0.0185442), (0, -0.00889793)],
]
TO_SI = [lambda cm: round(cm / 100, 12)] * 3 + [math.radians] * 4 + [float]
DESIGN = [TO_SI[k](row[k][0]) for row in TABLE_II for k in range(len(row))]
OPTIMISED = [TO_SI[k](row[k][0] if row[k][1] is HELD else row[k][1]) for row in TABLE_II for k in range(len(row))]
FREE = [i for i, (_, optimised) in enumerate(pair for row in TABLE_II for pair in row) if optimised is not HELD]
PUMA_LIMITS_DEG = [(-160, 160), (-225, 45), (-45, 225), (-110, 170), (-100, 100), (-266, 266)]

def puma_q(rng):
    """Random PUMA joint vector within the limits, radians, six decimals."""
    return [round(math.radians(rng.uniform(low, high)), 6) for low, high in PUMA_LIMITS_DEG]

# ---------------------------------------------------------------- kinematics.json: mpmath, one pose at a time

def mp_trans(x, y, z):
    return mp.matrix([[1, 0, 0, x], [0, 1, 0, y], [0, 0, 1, z], [0, 0, 0, 1]])

def mp_rotations(alpha, beta, gamma):
    """Rz(alpha), Ry(beta), Rx(gamma)."""
    (ca, cb, cg), (sa, sb, sg) = map(mp.cos, (alpha, beta, gamma)), map(mp.sin, (alpha, beta, gamma))
    return (mp.matrix([[ca, -sa, 0, 0], [sa, ca, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]),
            mp.matrix([[cb, 0, sb, 0], [0, 1, 0, 0], [-sb, 0, cb, 0], [0, 0, 0, 1]]),
            mp.matrix([[1, 0, 0, 0], [0, cg, -sg, 0], [0, sg, cg, 0], [0, 0, 0, 1]]))

def mp_forward(joints, p, q):
    """T as the product of every elementary matrix, in order."""
    T = mp.eye(4)
    for i in range(len(joints) + 1):
        rz, ry, rx = mp_rotations(*p[8 * i + 3:8 * i + 6])
        T = T * mp_trans(*p[8 * i:8 * i + 3]) * rz * ry * rx
        if i < len(joints):
            theta = p[8 * i + 6] + p[8 * i + 7] * q[i]
            T = T * (mp_rotations(theta, 0, 0)[0] if joints[i] == "R" else mp_trans(0, 0, theta))
    return T

def mp_length(joints, p, q, chuck, sphere):
    tip = mp_forward(joints, p, q) * mp.matrix([*sphere, 1])
    return mp.sqrt(sum((tip[k] - chuck[k]) ** 2 for k in range(3)))

def mp_slope(joints, p, k, *rest):
    """Central difference in parameter k; below 1e-30 it is only its own error, hence zero."""
    up, down = (mp_length(joints, p[:k] + [p[k] + h] + p[k + 1:], *rest) for h in (STEP, -STEP))
    return (up - down) / (2 * STEP) if abs(up - down) > 2e-30 * STEP else mpf(0)

def pose_case(joints, parameters, q, chuck, sphere):
    """One pose: floats in, exact conversion to mpf, everything in mpf, one rounding to float at the end."""
    p, q_, c, s = ([mpf(v) for v in values] for values in (parameters, q, chuck, sphere))
    T = mp_forward(joints, p, q_)
    return {"q": q, "chuck_m": chuck, "sphere_m": sphere,
            "base_from_tool": [[float(T[r, k]) for k in range(4)] for r in range(3)],
            "length_m": float(mp_length(joints, p, q_, c, s)),
            "gradient": [float(mp_slope(joints, p, k, q_, c, s)) for k in range(len(p))]}

def random_chain(rng, joints):
    """Nothing is small and nothing is aligned, so that no term of the gradient can hide."""
    p = []
    for joint in joints + "-":
        p += [rng.uniform(-0.5, 0.5) for _ in range(3)] + [rng.uniform(-math.pi, math.pi) for _ in range(3)]
        if joint != "-":
            reach = math.pi if joint == "R" else 0.3
            p += [rng.uniform(-reach, reach), rng.choice([1, 1, 1, -1]) * rng.uniform(0.8, 1.2)]
    return [round(v, 6) for v in p]

def random_point(rng, reach):
    return [round(rng.uniform(-reach, reach), 6) for _ in range(3)]

def make_kinematics():
    """Three chains of every size, the first all revolute and the second with a prismatic joint; then the PUMA."""
    rng, cases = random.Random(560), []
    for n in range(1, 9):
        mixed, any_ = [rng.choice("RP") for _ in range(n)], [rng.choice("RP") for _ in range(n)]
        mixed[rng.randrange(n)] = "P"
        for letter, joints in zip("abc", ("R" * n, "".join(mixed), "".join(any_))):
            p, poses = random_chain(rng, joints), []
            for _ in range(2):
                q = [round(rng.uniform(-3, 3) if joint == "R" else rng.uniform(-0.5, 0.5), 6) for joint in joints]
                poses.append(pose_case(joints, p, q, random_point(rng, 1.0), random_point(rng, 0.15)))
            cases.append({"name": f"random {n}{letter}", "joints": joints, "parameters": p, "poses": poses})
    for name, p in (("PUMA 560 design", DESIGN), ("PUMA 560 optimised", OPTIMISED)):
        poses = [pose_case("R" * 6, p, puma_q(rng), random_point(rng, 0.6), random_point(rng, 0.15)) for _ in range(4)]
        cases.append({"name": name, "joints": "R" * 6, "parameters": p, "poses": poses})
    return {"cases": cases}

# ---------------------------------------------------------------- fit.json: numpy, all poses at once, complex step

def turn(angle, u, v):
    """Plane rotation from u towards v: (x, y) for Rz, (y, z) for Rx, (z, x) for Ry."""
    return np.cos(angle) * u - np.sin(angle) * v, np.sin(angle) * u + np.cos(angle) * v

def np_lengths(p, q, chuck, sphere, joints="RRRRRR"):
    """Lengths of all poses (n), p real or complex, q (n, J), chuck and sphere (n, 3)."""
    x, y, z = sphere.T
    for i in reversed(range(len(joints) + 1)):
        if i < len(joints):
            theta = p[8 * i + 6] + p[8 * i + 7] * q[:, i]
            x, y, z = (*turn(theta, x, y), z) if joints[i] == "R" else (x, y, z + theta)
        dx, dy, dz, alpha, beta, gamma = p[8 * i:8 * i + 6]
        y, z = turn(gamma, y, z)
        z, x = turn(beta, z, x)
        x, y = turn(alpha, x, y)
        x, y, z = x + dx, y + dy, z + dz
    cx, cy, cz = chuck.T
    return np.sqrt((x - cx) ** 2 + (y - cy) ** 2 + (z - cz) ** 2)  # no abs(): the complex step goes through it

def np_jacobian(p, *rest):
    """d length / d parameter (n, 8J+6), complex step: exact to float64 rounding."""
    return np.array([np_lengths(p + 1e-30j * e, *rest).imag / 1e-30 for e in np.eye(len(p))]).T

def triangle(side, x, y, z):
    """Equilateral triangle about (x, y, z), parallel to the xy plane."""
    r = side / math.sqrt(3)
    return [[round(x + r * math.cos(a), 6), round(y + r * math.sin(a), 6), z]
            for a in (math.pi / 2, math.pi * 7 / 6, math.pi * 11 / 6)]

def scaled_singular_values(jacobian):
    norms = np.linalg.norm(jacobian, axis=0)
    assert norms.min() > 1e-3  # a column of rounding errors, scaled by its own norm, would invent rank
    return np.linalg.svd(jacobian / norms, compute_uv=False)

def make_fit():
    rng = random.Random(1995)
    chucks, spheres = triangle(0.200, 0.0, 0.45, 0.0), triangle(0.100, 0.0, 0.0, 0.05)
    truth, start = np.array(OPTIMISED), np.array(DESIGN)
    which = [(c, s) for c in range(3) for s in range(3) for _ in range(16)]
    chuck, sphere = np.array([chucks[c] for c, _ in which]), np.array([spheres[s] for _, s in which])
    q = np.array([puma_q(rng) for _ in which])
    measured = [round(float(d) + rng.gauss(0, 0.084e-3), 9) for d in np_lengths(truth, q, chuck, sphere)]
    assert min(measured) > 0.1

    def full(free):
        p = start.copy()
        p[FREE] = free
        return p

    def error(free):  # computed minus measured, so that its Jacobian is that of the length
        return np_lengths(full(free), q, chuck, sphere) - measured

    def slope(free):
        return np_jacobian(full(free), q, chuck, sphere)[:, FREE]

    free = least_squares(error, start[FREE], slope, method="lm", x_scale="jac", ftol=1e-15, xtol=1e-15, gtol=1e-15).x
    for _ in range(3):  # the last Gauss-Newton steps: nothing but rounding is left to move
        last_step = np.linalg.lstsq(slope(free), -error(free), rcond=None)[0]
        free = free + last_step
    assert np.abs(last_step).max() < 1e-12, last_step

    n, rss, rss_initial = len(which), *(float(e @ e) for e in (error(free), error(start[FREE])))
    jacobian = np_jacobian(full(free), q, chuck, sphere)
    r_inverse = np.linalg.inv(np.linalg.qr(jacobian[:, FREE], mode="r"))  # inv(JtJ) = inv(R) inv(R)^T
    std = np.sqrt(rss / (n - len(FREE)) * (r_inverse ** 2).sum(axis=1))
    s_all, s_free = scaled_singular_values(jacobian), scaled_singular_values(jacobian[:, FREE])
    assert s_all[35] > 1e-4 and s_all[36] < 1e-13, s_all[34:38]
    return {"robot": {"joints": "RRRRRR", "initial": DESIGN, "truth": OPTIMISED, "free": FREE},
            "chucks_m": chucks, "spheres_m": spheres,
            "poses": [{"chuck": c, "sphere": s, "q": qi.tolist(), "length_m": d}
                      for (c, s), qi, d in zip(which, q, measured)],
            "rms_initial_m": math.sqrt(rss_initial / n), "rms_m": math.sqrt(rss / n),
            "parameters": full(free).tolist(), "std": std.tolist(), "singular_values_all_scaled": s_all.tolist(),
            "condition_free_scaled": float(s_free[0] / s_free[-1])}

# ---------------------------------------------------------------- checks of this program itself

def self_check(kinematics):
    """Facts known without either implementation, and the two implementations of this file against each other."""
    assert len(DESIGN) == len(OPTIMISED) == 54 and len(FREE) == 36
    for joints in ("R", "PRP", "RRRRRRRR"):  # all parameters zero: the tool frame is the base frame
        zero = pose_case(joints, [0.0] * (8 * len(joints) + 6), [0.7] * len(joints), [0.0, 0.0, 0.0], [0.3, 0.0, 0.4])
        assert zero["length_m"] == float(mp.hypot(mpf(0.3), mpf(0.4)))
        assert zero["base_from_tool"] == np.eye(4)[:3].tolist()
        assert all(abs(g - u) < 1e-15 for g, u in zip(zero["gradient"], [0.6, 0, 0.8, 0, 0, 0]))
    planar = [0.0] * 7 + [1.0, 1.0] + [0.0] * 6 + [1.0, 1.0] + [0.0] * 5  # two unit bars in a plane, 90 and 90 degrees
    pose = pose_case("RR", planar, [math.pi / 2] * 2, [0.0] * 3, [0.0] * 3)
    assert np.allclose([row[3] for row in pose["base_from_tool"]], [-1, 1, 0], atol=1e-15)
    assert np.allclose([pose["gradient"][6], pose["gradient"][14]], [0, -math.sqrt(0.5)], atol=1e-15)
    worst = 0.0
    for case in kinematics["cases"]:
        for pose in case["poses"]:
            rotation = np.array(pose["base_from_tool"])[:, :3]
            assert np.allclose(rotation @ rotation.T, np.eye(3), atol=1e-14) and np.linalg.det(rotation) > 0
            assert abs(np.linalg.norm(pose["gradient"][:3]) - 1) < 1e-14 and pose["length_m"] > 0.05
            rest = np.array([pose["q"]]), np.array([pose["chuck_m"]]), np.array([pose["sphere_m"]]), case["joints"]
            p = np.array(case["parameters"])
            worst = max(worst, np.abs(np_jacobian(p, *rest)[0] - pose["gradient"]).max(),
                        abs(np_lengths(p, *rest)[0] - pose["length_m"]))
    assert worst < 1e-13, worst
    return worst

def write(name, document):
    """A line for every case and every pose; json writes floats by repr(), which reads back the same."""
    text = json.dumps(document, allow_nan=False)
    (HERE / name).write_text(re.sub(r' ?(\{"(name|q|chuck)":)', r"\n\1", text) + "\n")

if __name__ == "__main__":
    golden = make_kinematics()
    print("mpmath against complex step:", self_check(golden))
    write("kinematics.json", golden)
    fit = make_fit()
    print("rms", fit["rms_initial_m"], "->", fit["rms_m"], "condition", fit["condition_free_scaled"])
    print("singular values 35..38 of 54:", fit["singular_values_all_scaled"][34:38])
    write("fit.json", fit)
