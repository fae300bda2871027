"""Least-squares circles and cylinders to 60 digits, with nothing but Python's decimal arithmetic.

    python3 least_squares.py > least_squares.csv

Each case is a list of points with few digits (exact in binary or rounded the same way by every reader) and the centre and
radius with the least sum of squared distances to the circle or cylinder. Newton's method on the full problem, whose
Hessian is taken by central differences of the analytic gradient: the gradient at the end is below 1e-50.
"""
from decimal import Decimal as D, getcontext

getcontext().prec = 110


def solve(a, b):
    n = len(b)
    m = [row[:] + [value] for row, value in zip(a, b)]
    for col in range(n):
        pivot = max(range(col, n), key=lambda row: abs(m[row][col]))
        m[col], m[pivot] = m[pivot], m[col]
        for row in range(n):
            if row != col:
                factor = m[row][col] / m[col][col]
                m[row] = [x - factor * y for x, y in zip(m[row], m[col])]
    return [m[i][n] / m[i][i] for i in range(n)]


def gradient_circle(points, p):
    x, y, r = p
    g = [D(0)] * 3
    for px, py in points:
        u, v = px - x, py - y
        rho = (u * u + v * v).sqrt()
        e = rho - r
        g[0] -= e * u / rho
        g[1] -= e * v / rho
        g[2] -= e
    return g


def gradient_cylinder(points, p):
    """Axis through (x, y, 0) along (a, b, 1); squared distance |q|^2 - (q.d)^2/(d.d) with q from (x, y, 0)."""
    x, y, a, b, r = p
    n = 1 + a * a + b * b
    g = [D(0)] * 5
    for px, py, pz in points:
        u, v = px - x, py - y
        along = a * u + b * v + pz
        rho = (u * u + v * v + pz * pz - along * along / n).sqrt()
        e = rho - r
        # half the derivatives of the squared distance
        d = [-u + along * a / n, -v + along * b / n,
             -along * u / n + along * along * a / (n * n), -along * v / n + along * along * b / (n * n)]
        for k in range(4):
            g[k] += e * d[k] / rho
        g[4] -= e
    return g


def minimise(gradient, points, start):
    p = start[:]
    h = D(10) ** -35
    for _ in range(60):
        g = gradient(points, p)
        hessian = []
        for k in range(len(p)):
            up, down = p[:], p[:]
            up[k] += h
            down[k] -= h
            hessian.append([(s - t) / (2 * h) for s, t in zip(gradient(points, up), gradient(points, down))])
        step = solve(hessian, g)
        p = [value - s for value, s in zip(p, step)]
        if max(abs(s) for s in step) < D(10) ** -75:
            break
    assert max(abs(v) for v in gradient(points, p)) < D(10) ** -50
    return p


def noise(seed):
    """A 31-bit linear congruential generator, in [-1, 1) with three digits."""
    while True:
        seed = (1103515245 * seed + 12345) % 2 ** 31
        yield D(seed * 2000 // 2 ** 31 - 1000) / 1000


# Pythagorean directions: rational, so that the points have few digits (of a circle of radius 65, scaled).
DIRECTIONS = [(65, 0), (63, 16), (60, 25), (56, 33), (52, 39), (39, 52), (33, 56), (25, 60), (16, 63)]
AROUND = [(x * c - y * s, x * s + y * c) for c, s in [(1, 0), (0, 1), (-1, 0), (0, -1)] for x, y in DIRECTIONS]


def main():
    print("case,kind,x,y,z")
    cases = []
    for name, scale, size, offset, keep in [
        ("part", D(500), D(4), (D(20), D(-11)), AROUND),          # radius 32.5 mm in um, form of um
        ("arc", D(500), D(4), (D(20), D(-11)), AROUND[:12]),      # a third of the turn
        ("plot", D(1), D(30), (D(7), D(-5)), AROUND),             # deviations as large as half the radius
        ("far", D(500), D(4), (D(5000), D(3000)), AROUND),        # the centre millimetres off
    ]:
        rng = noise(len(name))
        points = [(x * scale + offset[0] + size * next(rng), y * scale + offset[1] + size * next(rng)) for x, y in keep]
        start = [offset[0], offset[1], 65 * scale]
        cases.append((name, "circle", points, minimise(gradient_circle, points, start)))
    for name, lean, size in [("wall", (D("0.0005"), D("-0.0003")), D(5)), ("steep", (D("0.05"), D("0.02")), D(20))]:
        rng = noise(7)
        points = []
        for z in range(0, 40001, 8000):
            points += [(x * 500 + lean[0] * z + 12 + size * next(rng), y * 500 + lean[1] * z - 9 + size * next(rng), D(z))
                       for x, y in AROUND]
        start = [D(12), D(-9), lean[0], lean[1], D(32500)]
        cases.append((name, "cylinder", points, minimise(gradient_cylinder, points, start)))
    for name, kind, points, p in cases:
        for point in points:
            print(name, "point", *(f"{value:f}" for value in point), *([] if len(point) == 3 else [""]), sep=",")
        symbols = ["x", "y", "r"] if kind == "circle" else ["x", "y", "a", "b", "r"]
        for symbol, value in zip(symbols, p):
            print(name, symbol, f"{value:.60f}", "", "", sep=",")


main()
