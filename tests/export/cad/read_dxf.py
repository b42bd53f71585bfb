"""Reads DXF files by ezdxf and says, a row each, what they hold.

    read_dxf.py FILE...     # rows such as "LINE S0_WALL 4.0000": layer, and length in metres
"""
import sys

import ezdxf


def describe(path):
    print("FILE", path)
    document = ezdxf.readfile(path)
    auditor = document.audit()
    print("version", document.dxfversion)
    print("errors", len(auditor.errors))
    print("fixes", len(auditor.fixes))
    print("units", document.header["$INSUNITS"], "text height", document.header["$DIMTXT"])
    view = document.viewports.get("*ACTIVE")[0].dxf
    half = (view.height * view.aspect_ratio / 2, view.height / 2)
    corners = (document.header["$EXTMIN"], document.header["$EXTMAX"])
    holds = all(abs(corner[k] - view.center[k]) < half[k] for corner in corners for k in (0, 1))
    print("view holds the drawing", holds)
    print("line scale", document.header["$LTSCALE"])
    used = {entity.dxf.layer for entity in document.modelspace()} | {"0", "DEFPOINTS"}
    print("empty layers", sum(layer.dxf.name.upper() not in used for layer in document.layers))
    faces_m2 = {}
    for layer in document.layers:
        print("LAYER", layer.dxf.name, "on" if layer.is_on() else "off")
    for entity in document.modelspace():
        kind, layer = entity.dxftype(), entity.dxf.layer
        if kind == "LINE":
            print(kind, layer, f"{entity.dxf.start.distance(entity.dxf.end):.4f}")
            print("STARTS", layer, " ".join(f"{value:.4f}" for value in entity.dxf.start))
        elif kind == "DIMENSION":
            block = document.blocks.get(entity.dxf.geometry)
            texts = [text.dxf.text for text in block.query("TEXT")]
            print(kind, layer, f"{entity.get_measurement():.4f}", *texts)
        elif kind == "TEXT":
            print(kind, layer, entity.dxf.text)
        elif kind == "POINT":
            print(kind, layer, " ".join(f"{value:.4f}" for value in entity.dxf.location))
        elif kind == "3DFACE":
            a, b, c = entity.wcs_vertices()[:3]
            faces_m2[layer] = faces_m2.get(layer, 0) + (b - a).cross(c - a).magnitude / 2
        elif kind == "POLYLINE":
            print(kind, layer, len(entity), "closed" if entity.is_closed else "open")
    for layer, area_m2 in sorted(faces_m2.items()):
        print("3DFACE", layer, f"{area_m2:.4f}")


for path in sys.argv[1:]:
    describe(path)
