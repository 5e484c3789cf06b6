"""Small toolkit for tileable textures: everything is computed on a torus, so
every map repeats without a seam. numpy only; deterministic for a given seed."""

import os
import numpy as np
from PIL import Image


def rng(seed):
    return np.random.Generator(np.random.PCG64(seed))


def coords(n):
    """Pixel-centre coordinates in 0..1: (u to the right, v downward)."""
    c = (np.arange(n) + 0.5) / n
    return np.meshgrid(c, c)


def _freq(n):
    f = np.fft.fftfreq(n, 1.0 / n)
    fx, fy = np.meshgrid(f, f)
    return fx, fy


def noise(n, seed, beta=1.0, lo=1.0, hi=None, ax=1.0, ay=1.0):
    """Periodic spectral noise, mean 0, deviation 1. Amplitude falls as f^-beta
    between `lo` and `hi` cycles per tile; ax, ay scale the frequency seen along
    each axis: ay well below ax gives features drawn out vertically."""
    fx, fy = _freq(n)
    f = np.hypot(fx * ay, fy * ax)
    hi = n / 2 if hi is None else hi
    amp = np.zeros_like(f)
    m = f >= lo * 0.999
    amp[m] = f[m] ** -beta
    amp *= np.exp(-((f / hi) ** 4))
    amp[0, 0] = 0.0
    w = rng(seed).standard_normal((n, n))
    r = np.fft.ifft2(np.fft.fft2(w) * amp).real
    return r / (r.std() + 1e-12)


def uniform_noise(n, seed, **kw):
    """Like `noise` but mapped to 0..1 with a flat distribution (approximately)."""
    x = noise(n, seed, **kw)
    return 1.0 / (1.0 + np.exp(-1.7 * x))


def blur(a, sigma):
    """Gaussian blur on the torus, sigma in pixels."""
    if a.ndim == 3:
        return np.stack([blur(a[..., i], sigma) for i in range(a.shape[2])], -1)
    n, m = a.shape
    fy = np.fft.fftfreq(n)[:, None]
    fx = np.fft.fftfreq(m)[None, :]
    g = np.exp(-2.0 * (np.pi * sigma) ** 2 * (fx * fx + fy * fy))
    return np.fft.ifft2(np.fft.fft2(a) * g).real


def sample(a, x, y):
    """Bilinear look-up at pixel coordinates, wrapping."""
    n, m = a.shape[:2]
    x0 = np.floor(x).astype(int)
    y0 = np.floor(y).astype(int)
    fx, fy = x - x0, y - y0
    if a.ndim == 3:
        fx, fy = fx[..., None], fy[..., None]
    g = lambda yy, xx: a[yy % n, xx % m]
    return (g(y0, x0) * (1 - fx) + g(y0, x0 + 1) * fx) * (1 - fy) + (
        g(y0 + 1, x0) * (1 - fx) + g(y0 + 1, x0 + 1) * fx) * fy


def smooth(e0, e1, x):
    t = np.clip((x - e0) / (e1 - e0), 0.0, 1.0)
    return t * t * (3.0 - 2.0 * t)


def mix(a, b, t):
    a, b = np.asarray(a, float), np.asarray(b, float)
    if np.ndim(t) == 2 and (a.ndim in (1, 3) or b.ndim in (1, 3)):
        t = t[..., None]
    return a + (b - a) * t


def cavity(h, sigma, gain):
    """Darkening of what lies lower than its surroundings (a touch of occlusion)."""
    return np.clip(1.0 + (h - blur(h, sigma)) * gain, 0.35, 1.25)[..., None]


def rgb(h):
    return np.array([int(h[i:i + 2], 16) for i in (0, 2, 4)], float) / 255.0


def hash01(ix, iy, seed):
    """A random number in 0..1 for each integer cell."""
    table = rng(seed).random(65536)
    k = (np.asarray(ix) * 7919 + np.asarray(iy) * 104729 + seed * 31) % 65536
    return table[k]


def worley(n, cells, seed, jitter=0.9):
    """Distances to the nearest and second nearest point of a jittered periodic
    grid (in cells), and the integer id of the nearest one."""
    u, v = coords(n)
    x, y = u * cells, v * cells
    ix, iy = np.floor(x).astype(int), np.floor(y).astype(int)
    r = rng(seed)
    px = 0.5 + (r.random((cells, cells)) - 0.5) * jitter
    py = 0.5 + (r.random((cells, cells)) - 0.5) * jitter
    f1 = np.full((n, n), 9.0)
    f2 = np.full((n, n), 9.0)
    ident = np.zeros((n, n), int)
    for dy in (-2, -1, 0, 1, 2):
        for dx in (-2, -1, 0, 1, 2):
            cx, cy = ix + dx, iy + dy
            qx = cx + px[cy % cells, cx % cells]
            qy = cy + py[cy % cells, cx % cells]
            d = np.hypot(x - qx, y - qy)
            near = d < f1
            f2 = np.where(near, f1, np.minimum(f2, d))
            ident = np.where(near, (cy % cells) * cells + cx % cells, ident)
            f1 = np.where(near, d, f1)
    return f1, f2, ident


def normal_from_height(h, size_m, depth_m, wrap=True):
    """Tangent-space normals of a height map (0..1 = 0..depth_m metres) that
    covers size_m metres (scalar or (width, height)). Green points to image-up.
    Sobel-weighted central differences."""
    rows, cols = h.shape
    sx, sy = (size_m, size_m) if np.isscalar(size_m) else size_m
    mode = 'wrap' if wrap else 'edge'
    p = np.pad(h, 1, mode=mode)
    s = lambda dy, dx: p[1 + dy:1 + dy + rows, 1 + dx:1 + dx + cols]
    gx = ((s(-1, 1) - s(-1, -1)) + 2 * (s(0, 1) - s(0, -1)) + (s(1, 1) - s(1, -1))) / 8
    gy = ((s(1, -1) - s(-1, -1)) + 2 * (s(1, 0) - s(-1, 0)) + (s(1, 1) - s(-1, 1))) / 8
    dx = gx * depth_m * cols / sx
    dy = gy * depth_m * rows / sy          # per metre, downward in the image
    nrm = np.stack([-dx, dy, np.ones_like(h)], -1)
    return nrm / np.linalg.norm(nrm, axis=-1, keepdims=True)


def encode_normal(nrm, step=1):
    """Flat encodes as exactly (128, 128, 255). A step of 2 rounds x and y to
    every second level (0.4 degrees): invisible on rough surfaces, and a third
    smaller as PNG."""
    n = np.array(nrm, float)
    if step > 1:
        n[..., :2] = np.round(n[..., :2] * 127.5 / step) * step / 127.5
        n[..., 2] = np.round(np.sqrt(np.clip(1 - (n[..., :2] ** 2).sum(-1), 0, 1)) * 127.5 / step) * step / 127.5
    q = np.floor(n * 127.5 + 128.0)
    return np.clip(q, 0, 255).astype(np.uint8)


def to8(a):
    return np.clip(np.floor(np.asarray(a) * 255.0 + 0.5), 0, 255).astype(np.uint8)


def save_jpg(path, a, quality=90):
    Image.fromarray(to8(a) if a.dtype != np.uint8 else a).save(
        path, quality=quality, subsampling=0, optimize=True)


def save_png(path, a):
    Image.fromarray(a).save(path, optimize=True)


def save_set(folder, name, base, spec, height, size_m, depth_m, step=2):
    """Write the four maps of one material; returns the record for textures.json."""
    height = np.clip(height, 0, 1)
    save_jpg(os.path.join(folder, name + '_base.jpg'), np.clip(base, 0, 1))
    hq = to8(height)
    # The normal map is taken from the height before it is rounded to 8 bits.
    save_png(os.path.join(folder, name + '_normal.png'),
             encode_normal(normal_from_height(height, size_m, depth_m), step))
    if spec.ndim == 2:
        spec = np.repeat(spec[..., None], 3, -1)
    # 32 grey levels are plenty for a reflectance and halve the file.
    save_png(os.path.join(folder, name + '_specular.png'), to8(np.round(np.clip(spec, 0, 1) * 31) / 31))
    save_png(os.path.join(folder, name + '_height.png'), hq)
    return {'size_m': size_m, 'depth_m': depth_m, 'pixels': int(height.shape[0])}


def relight(base, nrm, spec, light=(-0.5, 0.6, 0.6), tile=2):
    """A quick look: one directional light, diffuse + a highlight; for previews."""
    l = np.array(light, float)
    l /= np.linalg.norm(l)
    d = np.clip((nrm * l).sum(-1), 0, 1)
    hv = l + np.array([0, 0, 1.0])
    hv /= np.linalg.norm(hv)
    s = np.clip((nrm * hv).sum(-1), 0, 1) ** 40
    if spec.ndim == 2:
        spec = spec[..., None]
    lin = np.clip(base, 0, 1) ** 2.2 * (0.15 + 1.2 * d[..., None]) + spec * s[..., None] * 0.7
    out = np.clip(lin, 0, 1) ** (1 / 2.2)
    return np.tile(out, (tile, tile, 1))
