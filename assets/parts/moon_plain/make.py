"""Make the Moon: its regolith, its craters, its horizon and the Earth above it.

python -m assets.parts.moon_plain.make writes the files beside itself and in moon_craters and
moon_sky; the same numbers come out each time.
"""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from assets.parts.space.make import fractal, mix, ramp

Array = NDArray[np.float64]

PARTS = Path(__file__).parents[1]
SUN = np.array([-0.484, 0.775, 0.407])  # towards the lander's sun, 24 degrees high
NEAR = 100.0  # m, half the edge of the ground that is landed on
FAR = 16e3  # m, to the horizon's hills
RINGS, SECTORS = 36, 96
TILES = {"mid": 320.0, "far": 4000.0}  # m, how wide the picture of craters is laid
MID = 700.0  # m, where the one gives way to the other
POINTS = 257  # on the edge of the height field, 0.78 m apart
LEVEL = 12.0  # m around the site that large craters keep away from


def craters(rng: np.random.Generator, radii: Array, size: int, keep: float = 0.0) -> Array:
    """Return a periodic field of heights with craters of those radii, all in grid spacings.

    No rim comes nearer than ``keep`` to the middle. Old ones are shallow.
    """
    height = np.zeros((size, size))
    for radius in np.sort(radii)[::-1]:  # the small ones are on the large ones
        centre = rng.uniform(0.0, size, 2)
        if np.hypot(*(centre - size / 2.0)) < keep + 1.2 * radius:
            continue
        depth = 0.3 * radius * rng.uniform(0.15, 1.0) ** 1.5
        span = np.arange(-int(3.0 * radius) - 1, int(3.0 * radius) + 2)
        first, second = (np.floor(c).astype(int) + span for c in centre)
        out = np.hypot(first[:, None] - centre[0], second[None, :] - centre[1]) / radius
        bowl = -depth + 1.25 * depth * out**2
        rim = 0.25 * depth * np.exp(-3.2 * (out - 1.0)) * (1.0 - ramp(out, 2.0, 3.0))
        # A soft minimum of the two keeps the crest round.
        sharp = 0.35 * depth
        middle = 0.5 * (bowl + rim - np.sqrt((bowl - rim) ** 2 + sharp**2))
        where = np.ix_(first % size, second % size)
        height[where] += np.where(out < 2.6, middle, rim)
    return height


def sizes(rng: np.random.Generator, count: int, least: float, largest: float) -> Array:
    """Return radii of which nine times as many are a third as large."""
    result: Array = np.minimum(least * rng.random(count) ** -0.5, largest)
    return result


def lit(height: Array, albedo: Array, contrast: float) -> Image.Image:
    """Draw relief (rows along y, columns along x, in grid spacings) as the sun shows it."""
    x = 0.5 * (np.roll(height, -1, 1) - np.roll(height, 1, 1))
    y = 0.5 * (np.roll(height, -1, 0) - np.roll(height, 1, 0))
    facing = (SUN[2] - x * SUN[0] - y * SUN[1]) / np.sqrt(1.0 + x**2 + y**2) / SUN[2]
    shade = 1.0 + contrast * (np.clip(facing, 0.05, 2.4) - 1.0)
    grey = albedo * shade
    grey *= 205.0 / grey.mean()
    tint = np.array([1.0, 0.985, 0.96])
    picture = (grey[..., None] * tint).clip(0, 255).astype(np.uint8)
    return Image.fromarray(picture).quantize(40, dither=Image.Dither.NONE)


def regolith(rng: np.random.Generator) -> Image.Image:
    """Draw 10 m of ground from near: grains, stones, craters of a hand's width to a man's."""
    size = 512
    height = craters(rng, sizes(rng, 260, 3.0, 26.0), size) * 0.8
    height += 0.9 * fractal(rng, size, 1.35)
    for _ in range(420):  # stones
        row, column = rng.integers(0, size, 2)
        reach = 1 + int(rng.random() > 0.9)
        where = np.ix_(
            np.arange(row - reach, row + reach + 1) % size,
            np.arange(column - reach, column + reach + 1) % size,
        )
        height[where] += rng.uniform(0.5, 1.3) * reach
    return lit(height, 1.0 + 0.035 * fractal(rng, size, 1.0), 0.42)


def land(rng: np.random.Generator) -> Image.Image:
    """Draw craters upon craters, which look alike at every distance."""
    size = 1024
    height = craters(rng, sizes(rng, 1500, 3.0, 70.0), size) * 0.8
    height += 1.6 * fractal(rng, size, 1.7)
    return lit(height, 1.0 + 0.05 * fractal(rng, size, 1.5), 0.5)


def hills(rng: np.random.Generator, x: Array, y: Array) -> Array:
    """Return the far land's height [m]: level at the site, rolling, mountains at the horizon."""
    distance, height = np.hypot(x, y), np.zeros_like(x)
    for _ in range(400):
        away, around = FAR * rng.random() ** 0.7, rng.uniform(0.0, 2.0 * np.pi)
        width = rng.uniform(0.05, 0.14) * away + 60.0
        peak = width * rng.uniform(-0.05, 0.08) * (1.0 + 2.5 * float(ramp(away, 6e3, 15e3)))
        r = np.hypot(x - away * np.cos(around), y - away * np.sin(around))
        height += peak * np.exp(-((r / width) ** 2))
    rise = ramp(distance, NEAR * 1.5, 3e3)
    # The sphere falls away: by 74 m at 16 km.
    return height * rise - distance**2 / (2.0 * 1738e3) * rise


def horizon(rng: np.random.Generator) -> str:
    """Return the land around the square that is landed on, as MJCF: two meshes."""
    around = 2.0 * np.pi * np.arange(SECTORS) / SECTORS
    shares = np.arange(RINGS + 1) / RINGS
    radii = NEAR * (FAR / NEAR) ** shares
    square = 1.0 / np.maximum(np.abs(np.cos(around)), np.abs(np.sin(around)))
    stretch = square + (1.0 - square) * ramp(shares, 0.0, 0.3)[:, None]
    x, y = (radii[:, None] * stretch * f(around) for f in (np.cos, np.sin))
    z = hills(rng, x, y)
    z[0] = 0.0
    split = int(np.searchsorted(radii, MID))
    meshes = []
    for name, rows in {"mid": slice(0, split + 1), "far": slice(split, None)}.items():
        points = np.stack([part[rows].ravel() for part in (x, y, z)], axis=1)
        vertices = " ".join(f"{a:.1f} {b:.1f} {c:.2f}" for a, b, c in points)
        places = " ".join(f"{a:.3f} {b:.3f}" for a, b in points[:, :2] / TILES[name])
        faces = []
        for ring in range(len(points) // SECTORS - 1):
            for j in range(SECTORS):
                a, b = ring * SECTORS + j, ring * SECTORS + (j + 1) % SECTORS
                faces.append(f"{a} {a + SECTORS} {b + SECTORS} {a} {b + SECTORS} {b}")
        meshes.append(
            f'    <mesh name="{name}" inertia="shell" smoothnormal="true"\n'
            f'      vertex="{vertices}"\n      texcoord="{places}"\n'
            f'      face="{" ".join(faces)}"/>\n'
        )
    return f"<mujoco>\n  <asset>\n{''.join(meshes)}  </asset>\n</mujoco>\n"


def field(rng: np.random.Generator) -> Array:
    """Return the cratered ground's heights [m], (rows along y, columns along x)."""
    spacing = 2.0 * NEAR / (POINTS - 1)
    radii = np.concatenate([sizes(rng, 150, 4.5, 12.0), [14.0, 17.0, 21.0, 26.0, 30.0]])
    height = spacing * craters(rng, radii, POINTS, LEVEL / spacing)
    rolling, rough = fractal(rng, POINTS, 2.0), fractal(rng, POINTS, 1.4)
    height += 0.55 * rolling + 0.03 * rough
    x = np.linspace(-NEAR, NEAR, POINTS)
    inside = np.maximum(np.abs(x)[:, None], np.abs(x)[None, :])
    middle = POINTS // 2
    height -= height[middle, middle]
    result: Array = height * (1.0 - ramp(inside, 0.75 * NEAR, NEAR - spacing))
    return result


def earth(rng: np.random.Generator) -> Image.Image:
    """Draw one side of a cube around the Earth."""
    size = 256
    colour = np.full((size, size, 3), (14.0, 46.0, 120.0))
    share = ramp(fractal(rng, size, 1.9), 0.35, 0.6)
    colour = mix(colour, (108, 96, 58), 0.85 * share)
    clouds = ramp(0.7 * fractal(rng, size, 1.7) + 0.5 * fractal(rng, size, 1.2), 0.1, 1.3)
    colour = mix(colour, (246, 248, 252), 0.95 * clouds)
    picture = Image.fromarray(colour.clip(0, 255).astype(np.uint8))
    return picture.quantize(48, dither=Image.Dither.NONE)


def main() -> None:
    """Write every file."""
    plain = PARTS / "moon_plain"
    regolith(np.random.default_rng(1)).save(plain / "regolith.png", optimize=True)
    land(np.random.default_rng(2)).save(plain / "land.png", optimize=True)
    (plain / "horizon.xml").write_text(horizon(np.random.default_rng(3)))
    height = field(np.random.default_rng(4))
    shape = np.array(height.shape, dtype="<i4")
    values = height.astype("<f4")
    (PARTS / "moon_craters" / "craters.bin").write_bytes(shape.tobytes() + values.tobytes())
    print(f"moon_craters: lowest {values.min():.9g} m, range {np.ptp(values):.9g} m")
    earth(np.random.default_rng(5)).save(PARTS / "moon_sky" / "earth.png", optimize=True)


if __name__ == "__main__":
    main()
