"""Prints what trimesh finds in a mesh file, as JSON."""

import json
import sys

import numpy as np
import trimesh

mesh = trimesh.load(sys.argv[1], force="mesh", process=False)
colours = np.asarray(mesh.visual.vertex_colors) if mesh.visual.kind == "vertex" else np.zeros((0, 4), np.uint8)
points = len(mesh.vertices)
deviation = mesh.vertex_attributes.get("_DEVIATION_UM")
# Caps have vertices of their own for their normals: a solid is closed by positions.
solid = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
solid.merge_vertices(merge_norm=True)
print(
    json.dumps(
        {
            "points": points,
            "triangles": len(mesh.faces),
            "watertight": bool(solid.is_watertight),
            "winding_consistent": bool(solid.is_winding_consistent),
            "volume": float(solid.volume),
            "colours": len(np.unique(colours, axis=0)),
            "first_colour": [int(value) for value in colours[0]] if len(colours) else None,
            "deviation_range": None if deviation is None else [float(deviation.min()), float(deviation.max())],
        }
    )
)
