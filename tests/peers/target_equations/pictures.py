"""vtk and gltf: these pictures hold places of the nodes and shapes of the modes, and no equations."""

import json
import re
import struct
import xml.etree.ElementTree as xml

import numpy as np

from .oracle import Nodes

VTK_TYPES = {"Float64": "<f8", "Float32": "<f4", "Int64": "<i8", "Int32": "<i4", "UInt8": "u1"}


class Picture:
    """`positions` and `shape` (points x 3 x modes) are along axes of the model. `ids` has the numbers of the nodes, or is None where the file has none."""

    # Metres in a unit of length of the model if the file has metres, or 0 if it has the units of the model.
    metre = 0.0

    def nodes(self, model):
        """Returns the oracle with the shapes of the picture, and the largest error of its places relative to the extent."""
        extent = np.ptp(model.x, 0).max()
        places = self.positions / self.metre if self.metre else self.positions
        if self.ids is None:
            pick = [int(np.argmin(((places - x) ** 2).sum(1))) for x in model.x]
        else:
            at = {int(number): i for i, number in enumerate(self.ids)}
            pick = [at[int(node)] for node in model.ids]
        wrong = float(np.abs(places[pick] - model.x).max() / extent)
        rotation = None if self.rotation is None else self.rotation[pick]
        return Nodes(model, np.zeros(3), np.eye(3), self.shape[pick], rotation), wrong


class Vtk(Picture):

    def __init__(self, path):
        data = path.read_bytes()
        mark = data.index(b"_", data.index(b"<AppendedData")) + 1
        head = data[: data.index(b"<AppendedData")].decode() + "</VTKFile>"
        root = xml.fromstring(head if "</UnstructuredGrid>" in head else head.replace("</VTKFile>", "</UnstructuredGrid></VTKFile>"))

        def array(entry):
            at = mark + int(entry.get("offset"))
            (length,) = struct.unpack("<Q", data[at : at + 8])
            found = np.frombuffer(data[at + 8 : at + 8 + length], VTK_TYPES[entry.get("type")])
            return found.reshape(-1, int(entry.get("NumberOfComponents", "1")))

        entries = {entry.get("Name"): entry for entry in root.iter("DataArray")}
        at_points = {entry.get("Name"): array(entry) for entry in root.find(".//PointData")}
        self.positions = array(root.find(".//Points/DataArray"))
        self.ids = at_points["node"][:, 0]
        modes = sorted(name for name in at_points if name.startswith("mode_"))
        turns = sorted(name for name in at_points if name.startswith("rotation_"))
        self.shape = np.stack([at_points[name] for name in modes], 2)
        self.rotation = np.stack([at_points[name] for name in turns], 2) if turns else None
        self.frequency = array(entries["frequency_hz"])[:, 0]


class Gltf(Picture):

    def __init__(self, path, metre):
        data = path.read_bytes()
        (length,) = struct.unpack("<I", data[12:16])
        document, start = json.loads(data[20 : 20 + length]), 20 + length + 8

        def array(number):
            accessor = document["accessors"][number]
            view = document["bufferViews"][accessor["bufferView"]]
            at = start + view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
            width = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}[accessor["type"]]
            assert accessor["componentType"] == 5126
            return np.frombuffer(data, "<f4", accessor["count"] * width, at).reshape(-1, width).astype(float)

        primitive = document["meshes"][0]["primitives"][0]
        node = next(one for one in document["nodes"] if "mesh" in one)
        turn = quaternion(node.get("rotation", [0, 0, 0, 1]))
        self.positions = array(primitive["attributes"]["POSITION"]) @ turn.T + np.array(node.get("translation", [0, 0, 0]))
        self.shape = np.stack([array(target["POSITION"]) @ turn.T for target in primitive["targets"]], 2)
        self.metre = metre
        self.rotation, self.ids = None, None
        names = document["meshes"][0]["extras"]["targetNames"]
        self.frequency = np.array([float(found[1]) if (found := re.search(r"\(([\d.e+-]+) Hz\)", name)) else np.nan for name in names])


def quaternion(xyzw):
    """Returns the rotation matrix of a unit quaternion in the order of glTF."""
    x, y, z, w = xyzw
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)], [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                     [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])
