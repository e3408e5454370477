# SPDX-License-Identifier: BSD-3-Clause
"""Brushes for the simulator's textures: noise, dirt, scratches, bolts and lettering.

Images are float32 arrays of shape (height, width, 3), blue-green-red as OpenCV has them, 0..1.
"""

import cv2
import numpy as np

MUD = (62, 84, 104)


def flat(height, width, bgr):
    """Return a plane colour; `bgr` is three numbers 0..255."""
    return np.full((height, width, 3), np.array(bgr, np.float32) / 255, np.float32)


def band_noise(rng, height, width, wavelength):
    """Noise around one wavelength [pixel], seamless at the edges; zero mean, unit deviation."""
    fy = np.fft.fftfreq(height)[:, None]
    fx = np.fft.rfftfreq(width)[None, :]
    octaves = np.log2(np.maximum(np.hypot(fx, fy), 1e-9) * wavelength)
    spectrum = np.fft.rfft2(rng.standard_normal((height, width))) * np.exp(-0.5 * (octaves / 0.6) ** 2)
    noise = np.fft.irfft2(spectrum, s=(height, width))
    return ((noise - noise.mean()) / noise.std()).astype(np.float32)


def fractal(rng, height, width, amplitudes):
    """Sum of band noises; `amplitudes` maps wavelength [pixel] to standard deviation."""
    return sum(a * band_noise(rng, height, width, w) for w, a in amplitudes.items())


def tint(image, noise, strength=1.0):
    """Multiply brightness by 1 + strength * noise, in place."""
    image *= np.clip(1 + strength * noise, 0.05, 3)[..., None]


def blend(image, bgr, alpha):
    """Lay a colour (0..255) over the image with opacity `alpha` of shape (height, width), in place."""
    colour = np.array(bgr, np.float32) / 255
    image += np.clip(alpha, 0, 1)[..., None] * (colour - image)


def _wrapped(points, radius, height, width):
    """Yield the copies of a mark that show at the edges of a seamless image."""
    for x, y in points:
        for dx in (-width, 0, width):
            for dy in (-height, 0, height):
                if -radius <= x + dx < width + radius and -radius <= y + dy < height + radius:
                    yield x + dx, y + dy


def spots(rng, image, count, radii, bgr, opacity=(0.3, 0.9), power=2.0):
    """Scatter blots whose radius [pixel] falls off by a power law, seamlessly."""
    height, width = image.shape[:2]
    alpha = np.zeros((height, width), np.float32)
    low, high = radii
    for _ in range(count):
        radius = low + (high - low) * rng.random() ** (1 + power)
        centre = [(rng.random() * width, rng.random() * height)]
        axes = (radius, radius * rng.uniform(0.4, 1))
        strength, turn = rng.uniform(*opacity), rng.uniform(0, 180)
        for x, y in _wrapped(centre, radius, height, width):
            box = ((float(x), float(y)), (float(2 * axes[0]), float(2 * axes[1])), float(turn))
            cv2.ellipse(alpha, box, float(strength), -1, cv2.LINE_AA)
    blend(image, bgr, alpha)


def pebbles(rng, image, count, radii):
    """Stones of many greys with a lit and a dark side, seamlessly."""
    height, width = image.shape[:2]
    low, high = radii
    for _ in range(count):
        radius = low + (high - low) * rng.random() ** 3
        grey = rng.uniform(0.28, 0.92)
        warm = rng.uniform(0.88, 1.0)
        axes = (2 * radius, 2 * radius * rng.uniform(0.55, 1))
        turn = float(rng.uniform(0, 180))
        centre = [(rng.random() * width, rng.random() * height)]
        for x, y in _wrapped(centre, 2 * radius, height, width):
            for shift, shade in ((0.35, 0.35), (0, 1), (-0.25, 1.25)):
                size = 0.55 if shade > 1 else 1
                colour = tuple(float(min(1, c * grey * shade)) for c in (warm**2, warm, 1))
                place = (float(x + shift * radius), float(y + shift * radius))
                cv2.ellipse(image, (place, (axes[0] * size, axes[1] * size), turn), colour, -1, cv2.LINE_AA)


def scratches(rng, image, count, length, bgr, opacity=0.6):
    """Thin straight scratches of random direction."""
    height, width = image.shape[:2]
    alpha = np.zeros((height, width), np.float32)
    for _ in range(count):
        x, y, turn = rng.random() * width, rng.random() * height, rng.uniform(0, 2 * np.pi)
        reach = rng.uniform(*length)
        end = (int(x + reach * np.cos(turn)), int(y + reach * np.sin(turn)))
        cv2.line(alpha, (int(x), int(y)), end, float(rng.uniform(0.3, 1)), 1, cv2.LINE_AA)
    blend(image, bgr, opacity * alpha)


def cracks(rng, image, count, steps, bgr, opacity=0.8):
    """Wandering cracks, seamlessly."""
    height, width = image.shape[:2]
    alpha = np.zeros((height, width), np.float32)
    for _ in range(count):
        x, y, turn = rng.random() * width, rng.random() * height, rng.uniform(0, 2 * np.pi)
        for _ in range(steps):
            turn += rng.normal(0, 0.35)
            stride = rng.uniform(4, 12)
            nx, ny = x + stride * np.cos(turn), y + stride * np.sin(turn)
            cv2.line(
                alpha, (int(x), int(y)), (int(nx), int(ny)), 1.0, 1 + int(rng.random() < 0.4), cv2.LINE_AA
            )
            x, y = nx % width, ny % height
    blend(image, bgr, opacity * alpha)


def grime(rng, image, bgr, strength, coarse=60):
    """Dirt that gathers towards the bottom and in patches."""
    height, width = image.shape[:2]
    patches = fractal(rng, height, width, {coarse: 0.5, coarse / 3: 0.35, coarse / 10: 0.3})
    low = np.linspace(-0.6, 0.9, height, dtype=np.float32)[:, None]
    blend(image, bgr, strength * np.clip(patches + low, 0, 1.2))


def weather(rng, image, mud, fine=1.0):
    """Wear paint outdoors: stains of every size, stone chips, scratches, mud from below."""
    height, width = image.shape[:2]
    tint(
        image,
        fractal(rng, height, width, {110: 0.06, 44: 0.08, 18: 0.09, 8: 0.11 * fine, 4: 0.09 * fine}),
    )
    area = height * width / 1e6
    spots(rng, image, int(900 * area), (1.5, 14), (26, 30, 34), (0.35, 0.95), 3)
    spots(rng, image, int(500 * area), (1.5, 9), (190, 204, 210), (0.3, 0.8), 3)
    spots(rng, image, int(260 * area), (3, 24), MUD, (0.4, 0.9), 3)
    scratches(rng, image, int(160 * area), (10, 90), (150, 160, 165), 0.7)
    scratches(rng, image, int(120 * area), (10, 70), (20, 22, 24), 0.7)
    grime(rng, image, MUD, mud, 90)


def bolt(image, x, y, radius):
    """Draw a bolt head with a lit rim."""
    cv2.circle(image, (x, y), radius + 2, (0.05, 0.05, 0.05), -1, cv2.LINE_AA)
    cv2.circle(image, (x, y), radius, (0.55, 0.56, 0.58), -1, cv2.LINE_AA)
    cv2.circle(image, (x - 1, y - 1), max(1, radius // 2), (0.85, 0.86, 0.88), -1, cv2.LINE_AA)
    cv2.line(image, (x - radius, y), (x + radius, y), (0.15, 0.15, 0.15), 1, cv2.LINE_AA)


def label(image, text, x, y, height, bgr, thickness):
    """Letters with their lower left corner at (x, y) and `height` pixels tall."""
    colour = tuple(c / 255 for c in bgr)
    cv2.putText(image, text, (x, y), cv2.FONT_HERSHEY_DUPLEX, height / 22.0, colour, thickness, cv2.LINE_AA)


def stripes(image, x, y, width, height, pitch, colours):
    """Slanted warning stripes in a rectangle."""
    yy, xx = np.mgrid[0:height, 0:width]
    first = ((xx + yy) // pitch) % 2 == 0
    a, b = (np.array(c, np.float32) / 255 for c in colours)
    image[y : y + height, x : x + width] = np.where(first[..., None], a, b)


def save(path, image):
    """Write an 8-bit PNG."""
    if not cv2.imwrite(str(path), np.clip(image * 255 + 0.5, 0, 255).astype(np.uint8)):
        raise OSError(f"cannot write {path}")
