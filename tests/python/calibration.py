"""Calibrates the cameras of tests/sensors/calibration.rs, one camera at many places, by their pictures of a chessboard.

    calibration.py FOLDER
"""

import json
import sys
from pathlib import Path

import cv2
import numpy as np

folder = Path(sys.argv[1])
described = json.loads((folder / "sensors.json").read_text())["sensors"]
k, d = np.array(described[0]["K"]), np.array(described[0]["D"])
size = (described[0]["width"], described[0]["height"])
is_round = described[0]["distortion_model"] == "equidistant"
project = cv2.fisheye.projectPoints if is_round else cv2.projectPoints
# The inner corners of 10 × 7 squares of 0.1 m, where the world has them; Y is up.
columns, rows = np.meshgrid((np.arange(9) - 4) * 0.1, (2.5 - np.arange(6)) * 0.1)
board = np.stack([columns, rows, np.zeros_like(rows)], -1).reshape(-1, 1, 3)
stop = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, 200, 1e-9)

pixels, errors, slopes = [], [], []
for sensor in described:
    path = folder / sensor["name"] / "color_00000.png"
    picture = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
    found, corners = cv2.findChessboardCorners(picture, (9, 6))
    assert found, path
    corners = cv2.cornerSubPix(picture, corners, (4, 4), (-1, -1), stop).reshape(-1, 2).astype(np.float64)
    capture = sensor["captures"][0]
    world_from_camera = np.array(capture["world_from_entity"]) @ np.array(sensor["entity_from_sensor"])
    camera_from_world = np.linalg.inv(world_from_camera)
    points = board @ camera_from_world[:3, :3].T + camera_from_world[:3, 3]
    where, slope = project(points, np.zeros(3), np.zeros(3), k, d)
    where = where.reshape(-1, 2)
    # The detector begins at either end of the board.
    if np.linalg.norm(corners[0] - where[0]) > np.linalg.norm(corners[-1] - where[0]):
        corners = corners[::-1]
    pixels.append(corners)
    errors.append(corners - where)
    # By fx, fy, cx, cy and the coefficients.
    slopes.append(slope[:, :8] if is_round else slope[:, 6:14])

# At the poses that the description has, corners are where it puts them: what they are off by on average is chance, and
# what a change of K and D would explain of it, too. Chance exceeds five standard deviations once in a million times.
errors, slopes = np.concatenate(errors).ravel(), np.concatenate(slopes)
spread = errors.std()
# Of the detector: 0.1 pixels for squares of some 20.
assert spread < 0.2, spread
offset = np.abs(errors.reshape(-1, 2).mean(0))
assert (offset < 5 * spread / np.sqrt(len(errors) / 2)).all(), offset
change, *_ = np.linalg.lstsq(slopes, errors)
deviation = spread * np.sqrt(np.diag(np.linalg.inv(slopes.T @ slopes)))
assert (np.abs(change) < 5 * deviation).all(), (change, deviation)
# As a whole it would move no corner by a tenth of a pixel.
assert np.abs(slopes @ change).max() < 0.1, np.abs(slopes @ change).max()
print(f"{len(errors) // 2} corners, {spread:.3f} pixels; {np.abs(change / deviation).max():.1f} deviations at most")

if not is_round:
    focal = np.array([k[0, 0], k[1, 1]])
    assert (np.abs(change[:2]) < 1e-3 * focal).all(), change
    # As users calibrate, who know no pose: within what OpenCV says of its own results by what is left of the errors, of
    # which focal lengths have a thousandth.
    flat = board.reshape(-1, 3).astype(np.float32)
    calibrated = cv2.calibrateCameraExtended(
        [flat] * len(pixels), [found.astype(np.float32) for found in pixels], size, None, None,
        flags=cv2.CALIB_FIX_K3, criteria=stop,
    )
    own_k, own_d, deviation = calibrated[1], calibrated[2].ravel(), calibrated[5].ravel()[:8]
    own = np.array([own_k[0, 0], own_k[1, 1], own_k[0, 2], own_k[1, 2], *own_d[:4]])
    off = own - [k[0, 0], k[1, 1], k[0, 2], k[1, 2], *d[:4]]
    assert (np.abs(off) < 5 * deviation).all() and (deviation[:2] < 1e-3 * focal).all(), (off, deviation)
    print(f"calibrated: {own.round(4).tolist()}, {np.abs(off / deviation).max():.1f} deviations at most")
