"""The taut string through a sequence of leaves in the plane: the funnel algorithm.

The funnel is what the last bend sees through the faces so far, between its left and right side. A
face that lies beyond one side makes the string bend at that side's end (Lee and Preparata 1984).
"""

from __future__ import annotations

import numpy as np

from hzmp_planners._arrays import Floats

Pair = tuple[float, float]


def taut_string(start: Floats, goal: Floats, corners: Floats, ahead: Floats) -> Floats:
    """The shortest path that crosses some faces of disjoint leaves one after the other.

    Args:
        start: shape (2,) [m].
        goal: shape (2,) [m].
        corners: ends of each face, shape (K-1, 2, 2) [m].
        ahead: normals of the faces in the direction of travel, shape (K-1, 2).

    Returns:
        Start, a point on each face, and goal, shape (K+1, 2) [m].
    """
    faces: list[tuple[Pair, Pair]] = []  # left and right end
    for ((a_x, a_y), (b_x, b_y)), (n_x, n_y) in zip(corners.tolist(), ahead.tolist(), strict=True):
        a, b = (a_x, a_y), (b_x, b_y)
        faces.append((b, a) if n_x * (b_y - a_y) - n_y * (b_x - a_x) > 0.0 else (a, b))
    (x, y), (g_x, g_y) = start.tolist(), goal.tolist()
    faces.append(((g_x, g_y), (g_x, g_y)))
    points = [(x, y)]
    root = points[0]
    for face, bend in _bends(root, faces):
        points += [crossing(root, bend, *ends) for ends in faces[len(points) - 1 : face]]
        points.append(bend)
        root = bend
    return np.array(points)


def _bends(root: Pair, faces: list[tuple[Pair, Pair]]) -> list[tuple[int, Pair]]:
    """Where the string bends: at ends of which faces; last is the goal, a face of one point."""
    bends: list[tuple[int, Pair]] = []
    left = right = root
    left_face = right_face = face = 0
    while face < len(faces):
        one, two = faces[face]
        if _turn(root, left, two) > 0.0:
            root, face = right, right_face = left, left_face
            bends.append((face, root))
        elif _turn(root, right, one) < 0.0:
            root, face = left, left_face = right, right_face
            bends.append((face, root))
        else:
            if _turn(root, left, one) <= 0.0:
                left, left_face = one, face
            if _turn(root, right, two) >= 0.0:
                right, right_face = two, face
        face += 1
    return [*bends, (len(faces) - 1, faces[-1][0])]


def _turn(root: Pair, a: Pair, b: Pair) -> float:
    """Positive when b is to the left of the line from the root through a."""
    x, y = root
    return (a[0] - x) * (b[1] - y) - (a[1] - y) * (b[0] - x)


def crossing(root: Pair, aim: Pair, left: Pair, right: Pair) -> Pair:
    """Where the line from a root to a point beyond a face crosses it; else its nearest end."""
    (x, y), (aim_x, aim_y), (left_x, left_y) = root, aim, left
    along_x, along_y = right[0] - left_x, right[1] - left_y
    before = along_x * (y - left_y) - along_y * (x - left_x)
    after = along_x * (aim_y - left_y) - along_y * (aim_x - left_x)
    share = 0.5 if before == after else before / (before - after)
    p_x, p_y = x + share * (aim_x - x), y + share * (aim_y - y)
    square = along_x * along_x + along_y * along_y
    t = ((p_x - left_x) * along_x + (p_y - left_y) * along_y) / square if square else 0.0
    t = min(max(t, 0.0), 1.0)
    return left_x + t * along_x, left_y + t * along_y
