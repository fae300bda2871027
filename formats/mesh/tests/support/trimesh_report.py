"""Prints what trimesh, and MeshLab where it is installed, find in a mesh file, as JSON."""

import json
import sys

import numpy as np
import trimesh


def solid(mesh):
    return {
        "points": len(mesh.vertices),
        "watertight": bool(mesh.is_watertight),
        "winding_consistent": bool(mesh.is_winding_consistent),
        "is_volume": bool(mesh.is_volume),
        "body_count": int(mesh.body_count),
        "volume": float(mesh.volume),
    }


def meshlab(path):
    try:
        import pymeshlab
    except ImportError:
        return None
    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.load_new_mesh(path)
    measures = meshes.get_topological_measures()
    return {key: value for key, value in measures.items() if isinstance(value, (int, bool))}


mesh = trimesh.load(sys.argv[1], force="mesh", process=False)
colours = np.asarray(mesh.visual.vertex_colors) if mesh.visual.kind == "vertex" else np.zeros((0, 4), np.uint8)
deviation = mesh.vertex_attributes.get("_DEVIATION_UM", mesh.vertex_attributes.get("quality"))
print(
    json.dumps(
        {
            "triangles": len(mesh.faces),
            "as_written": solid(mesh),
            "merged": solid(trimesh.load(sys.argv[1], force="mesh")),
            "meshlab": meshlab(sys.argv[1]),
            "volume": float(mesh.volume),
            "colours": len(np.unique(colours, axis=0)),
            "first_colour": [int(value) for value in colours[0]] if len(colours) else None,
            "deviation_range": None if deviation is None else [float(deviation.min()), float(deviation.max())],
        }
    )
)
