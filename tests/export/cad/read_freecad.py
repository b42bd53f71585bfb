"""Reads DXF files by FreeCAD's own importer and says, rows each, what it made of them.

    SLCMAP_DXF=FILE:FILE... freecadcmd read_freecad.py   # FreeCAD takes file names for its own

Rows are "slcmap EDGE 4000.0" (length in millimetres, FreeCAD's unit), "slcmap POINT x y z" and
"slcmap TEXT words".
"""
import os

import FreeCAD
import Import

FreeCAD.ParamGet("User parameter:BaseApp/Preferences/Mod/Draft").SetBool("dxftext", True)
for path in os.environ["SLCMAP_DXF"].split(":"):
    document = FreeCAD.newDocument()
    Import.readDXF(path, document.Name)
    print()
    for item in document.Objects:
        if item.TypeId == "App::Annotation":
            print("slcmap TEXT", " ".join(item.LabelText))
        elif not hasattr(item, "Shape"):
            continue
        elif item.Shape.ShapeType == "Edge":
            print(f"slcmap EDGE {item.Shape.Length:.1f}")
        elif item.Shape.ShapeType == "Vertex":
            print("slcmap POINT", " ".join(f"{value:.1f}" for value in item.Shape.Point))
