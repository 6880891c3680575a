"""Make the space part's pictures and the planet's mesh: stars.png, planet.png, planet.xml.

python assets/parts/space/make.py writes them beside itself; the same numbers come out each time.
"""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageFilter

Array = NDArray[np.float64]

HERE = Path(__file__).parent
STARS = 512  # pixels on the edge of each of the six sides of the sky
PLANET = 1024  # pixels on the edge of the planet's picture
RADIUS = 5096.8  # m: 6371 km at 400 m / 500 km, so that 400 m of height look like 500 km
HEIGHT = 400.0  # m, from the origin to the surface
HORIZON = np.arccos(RADIUS / (RADIUS + HEIGHT))  # rad, around the planet's centre: 22 degrees
AIR = 0.013 * RADIUS  # m: what glows above the horizon
LIMB = 0.95  # where the horizon lies in the picture, of half its edge; the air is outside
RINGS, SECTORS = 16, 96


def fractal(rng: np.random.Generator, size: int, slope: float) -> Array:
    """Return periodic noise of unit variance whose amplitude falls as frequency^-slope."""
    f = np.hypot(np.fft.fftfreq(size)[:, None], np.fft.rfftfreq(size)[None, :]) * size
    f[0, 0] = np.inf
    spectrum = np.fft.rfft2(rng.standard_normal((size, size))) * np.maximum(f, 1.5) ** -slope
    noise = np.fft.irfft2(spectrum, s=(size, size))
    result: Array = (noise - noise.mean()) / noise.std()
    return result


def ramp(x: Array, low: float, high: float) -> Array:
    """Return 0 below ``low``, 1 above ``high`` and a smooth rise between them."""
    t = np.clip((x - low) / (high - low), 0.0, 1.0)
    result: Array = t * t * (3.0 - 2.0 * t)
    return result


def mix(a: Array, b: tuple[int, int, int], share: Array) -> Array:
    """Return colour ``a`` with ``share`` of colour ``b``."""
    result: Array = a + (np.array(b, float) - a) * share[..., None]
    return result


def planet(rng: np.random.Generator) -> Image.Image:
    """Draw the cap seen from above, azimuthal equidistant, in a ring of air."""
    land, green, deep = (fractal(rng, PLANET, s) for s in (1.75, 1.6, 1.8))
    colour = np.full((PLANET, PLANET, 3), (10.0, 32.0, 78.0))
    colour = mix(colour, (14, 62, 104), ramp(deep, -0.5, 2.0))
    colour = mix(colour, (34, 112, 128), ramp(land, 0.25, 0.6))  # shelf
    ground = mix(np.full_like(colour, (132.0, 112.0, 76.0)), (62, 82, 44), ramp(green, -0.6, 0.7))
    share = ramp(land, 0.55, 0.63)[..., None]
    colour = colour * (1.0 - share) + ground * share

    fine, banks = fractal(rng, PLANET, 1.25), fractal(rng, PLANET, 1.9)
    drift = 26.0 * np.stack([fractal(rng, PLANET, 2.2), fractal(rng, PLANET, 2.2)])
    rows, columns = (np.indices((PLANET, PLANET)) + drift).round().astype(int) % PLANET
    clouds = ramp((0.7 * banks + 0.7 * fine)[rows, columns], -0.1, 1.7)
    colour = mix(colour, (246, 248, 252), 0.96 * clouds)

    y, x = (np.indices((PLANET, PLANET)) + 0.5) * 2.0 / PLANET - 1.0
    out = np.hypot(x, y) / LIMB
    colour = mix(colour, (92, 148, 214), 0.75 * ramp(out, 0.5, 1.0) ** 2)  # air seen edgewise
    colour = mix(colour, (150, 200, 250), ramp(out, 0.94, 1.0))
    above = np.clip((out - 1.0) / (1.0 / LIMB - 1.0), 0.0, 1.0)
    colour *= np.exp(-5.0 * above)[..., None] * (1.0 - above**2)[..., None]
    colour[..., 0] *= np.exp(-3.0 * above)
    picture = Image.fromarray(colour.clip(0, 255).astype(np.uint8))
    return picture.quantize(128, dither=Image.Dither.NONE)


def stars(rng: np.random.Generator) -> Image.Image:
    """Draw the sky's six sides in a row: right, left, up, down, front, back."""
    count = 2600
    where = rng.standard_normal((count, 3))
    band = rng.random(count) < 0.45  # a share of them lies along the galaxy
    pole = np.array([0.3, 0.8, 0.52])
    where[band] -= 0.86 * (where[band] @ pole)[:, None] * pole
    flux = np.minimum(0.16 * rng.random(count) ** -0.75, 2.4)
    warmth = rng.normal(0.0, 0.09, count)
    tint = np.stack([1.0 + warmth, np.ones(count), 1.0 - warmth], axis=1)

    sky = np.zeros((6, STARS, STARS, 3))
    side = 2 * np.abs(where).argmax(axis=1)
    side += np.take_along_axis(where, side[:, None] // 2, axis=1)[:, 0] < 0.0
    for i in range(count):
        axis = side[i] // 2
        u, v = np.delete(where[i], axis) / abs(where[i, axis])
        column, row = (np.array([u, v]) * 0.5 + 0.5) * STARS
        r, c = np.indices((3, 3)) - 1
        rows, columns = int(row) + r, int(column) + c
        inside = (rows >= 0) & (rows < STARS) & (columns >= 0) & (columns < STARS)
        distance = np.hypot(rows + 0.5 - row, columns + 0.5 - column)
        glow = flux[i] * np.exp(-((distance / 0.55) ** 2))
        sky[side[i], rows[inside], columns[inside]] += (glow[..., None] * tint[i])[inside] * 255.0
    sides = [Image.fromarray(face.clip(0, 255).astype(np.uint8)) for face in sky]
    row = Image.new("RGB", (6 * STARS, STARS))
    for i, face in enumerate(sides):
        row.paste(face, (i * STARS, 0))
    return row


def foil(rng: np.random.Generator) -> Image.Image:
    """Draw crinkled gold foil."""
    height = np.abs(fractal(rng, 128, 1.15)) + 0.6 * np.abs(fractal(rng, 128, 1.0))
    light = np.gradient(height, axis=0) + 0.6 * np.gradient(height, axis=1)
    shade = np.clip(0.8 + 0.35 * light / light.std() / 2.0, 0.3, 1.25)
    colour = shade[..., None] * np.array([255.0, 196.0, 92.0])
    picture = Image.fromarray(colour.clip(0, 255).astype(np.uint8))
    return picture.filter(ImageFilter.GaussianBlur(0.6)).quantize(64, dither=Image.Dither.NONE)


def cells() -> Image.Image:
    """Draw one group of 4 x 4 solar cells with its grid and cut corners."""
    y, x = np.indices((128, 128)) % 32
    colour = np.full((128, 128, 3), (22.0, 34.0, 92.0))
    colour[(x % 8 == 4)] = (32, 48, 112)  # fingers
    seam = (x < 1) | (y < 1)
    corner = np.minimum(x, 31 - x) + np.minimum(y, 31 - y) < 5
    colour[seam | corner] = (150, 156, 172)
    return Image.fromarray(colour.astype(np.uint8))


def mesh() -> str:
    """Return the cap as MJCF, its pole at the origin and the planet's centre below it."""
    shares = (np.arange(1, RINGS + 1) / RINGS) ** 0.7  # finer towards the horizon
    rings = [(RADIUS, HORIZON * share, LIMB * share) for share in shares]
    rings += [(RADIUS + AIR / 2.0, HORIZON, (LIMB + 1.0) / 2.0), (RADIUS + AIR, HORIZON, 1.0)]
    azimuths = 2.0 * np.pi * np.arange(SECTORS) / SECTORS
    vertices, places = ["0 0 0"], ["0.5 0.5"]
    for radius, angle, share in rings:
        for azimuth in azimuths:
            east, north = np.cos(azimuth), np.sin(azimuth)
            out, down = radius * np.sin(angle), radius * np.cos(angle) - RADIUS
            vertices.append(f"{out * east:.2f} {out * north:.2f} {down:.2f}")
            places.append(f"{0.5 + 0.5 * share * east:.4f} {0.5 + 0.5 * share * north:.4f}")
    faces = []
    for j in range(SECTORS):
        k = (j + 1) % SECTORS
        faces.append(f"0 {1 + j} {1 + k}")
        for ring in range(len(rings) - 1):
            a, b = 1 + ring * SECTORS, 1 + (ring + 1) * SECTORS
            faces.append(f"{a + j} {b + j} {b + k}")
            faces.append(f"{a + j} {b + k} {a + k}")
    return (
        "<mujoco>\n  <asset>\n"
        f'    <mesh name="planet" inertia="shell"\n      vertex="{" ".join(vertices)}"\n'
        f'      texcoord="{" ".join(places)}"\n      face="{" ".join(faces)}"/>\n'
        "  </asset>\n</mujoco>\n"
    )


def main() -> None:
    """Write every file."""
    rng = np.random.default_rng(2026)
    planet(rng).save(HERE / "planet.png", optimize=True)
    stars(rng).save(HERE / "stars.png", optimize=True)
    foil(rng).save(HERE.parent / "bus" / "foil.png", optimize=True)
    cells().save(HERE.parent / "bus" / "cells.png", optimize=True)
    (HERE / "planet.xml").write_text(mesh())


if __name__ == "__main__":
    main()
