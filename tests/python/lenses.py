"""Where OpenCV puts points: tests/sensors/lenses.rs.

    lenses.py FILE

FILE holds a list of cameras: model (brown_conrady or kannala_brandt), k (fx, fy, cx, cy), d, and points, X right,
Y down, Z forward. Prints a list of their pixels for each.
"""

import json
import sys

import cv2
import numpy as np

found = []
for camera in json.load(open(sys.argv[1])):
    fx, fy, cx, cy = camera["k"]
    k = np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]])
    points = np.array(camera["points"]).reshape(-1, 1, 3)
    project = {"brown_conrady": cv2.projectPoints, "kannala_brandt": cv2.fisheye.projectPoints}[camera["model"]]
    pixels, _ = project(points, np.zeros(3), np.zeros(3), k, np.array(camera["d"]))
    found.append(pixels.reshape(-1, 2).tolist())
print(json.dumps(found))
