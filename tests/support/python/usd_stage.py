"""What the USD library finds in an exported stage: usd_stage.py FILE prints it as JSON. Run by a Python that has usd-core."""
import json
import sys

from pxr import Gf, Usd, UsdGeom, UsdLux, UsdShade


def surface_of(prim):
    material, _ = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial()
    surface, _, _ = material.ComputeSurfaceSource()
    assert surface.GetIdAttr().Get() == "UsdPreviewSurface"
    return {"color": list(surface.GetInput("diffuseColor").Get()), "index": surface.GetInput("ior").Get(),
            "roughness": surface.GetInput("roughness").Get()}


def source_of(shader, name):
    """The shader that is connected to an input."""
    (source,), _ = shader.GetInput(name).GetConnectedSources()
    return UsdShade.Shader(source.source.GetPrim())


def hair_of(prim):
    """The two hair materials of the MaterialX network, {"share", "hair": [{...}, {...}]}; None without one."""
    material, _ = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial()
    surface, _, _ = material.ComputeSurfaceSource("mtlx")
    if not surface or surface.GetIdAttr().Get() != "ND_surface":
        return None
    mixture = source_of(surface, "bsdf")
    assert mixture.GetIdAttr().Get() == "ND_mix_bsdf"
    hair = []
    for side in ("bg", "fg"):
        h = source_of(mixture, side)
        assert h.GetIdAttr().Get() == "ND_chiang_hair_bsdf" and h.GetInput("cuticle_angle").Get() == 0.5
        rough = [source_of(h, f"roughness_{lobe}") for lobe in ("R", "TT", "TRT")]
        assert len({r.GetPath() for r in rough}) == 1 and rough[0].GetIdAttr().Get() == "ND_chiang_hair_roughness"
        assert (rough[0].GetInput("scale_TT").Get(), rough[0].GetInput("scale_TRT").Get()) == (0.5, 2.0)
        hair.append({"longitudinal": rough[0].GetInput("longitudinal").Get(), "azimuthal": rough[0].GetInput("azimuthal").Get(),
                     "index": h.GetInput("ior").Get(), "absorption": list(h.GetInput("absorption_coefficient").Get())})
    return {"share": mixture.GetInput("mix").Get(), "hair": hair}


def curves_of(stage, tile):
    found = []
    for prim in Usd.PrimRange(stage.GetPrimAtPath(tile)):
        if not prim.IsA(UsdGeom.BasisCurves):
            continue
        c = UsdGeom.BasisCurves(prim)
        points, counts, widths = c.GetPointsAttr().Get(), c.GetCurveVertexCountsAttr().Get(), c.GetWidthsAttr().Get()
        assert sum(counts) == len(points) and len(widths) == len(counts) and c.GetWidthsInterpolation() == "uniform"
        assert (c.GetTypeAttr().Get(), c.GetBasisAttr().Get(), c.GetWrapAttr().Get()) == ("cubic", "bspline", "nonperiodic")
        right, at = UsdGeom.Boundable.ComputeExtentFromPlugins(c, Usd.TimeCode.Default()), 0
        fibers = []
        for n, width in zip(counts, widths):
            fibers.append({"points": [list(p) for p in points[at:at + n]], "radius": width / 2})
            at += n
        found.append({"fibers": fibers, "surface": surface_of(prim), "mixture": hair_of(prim), "display": list(c.GetDisplayColorAttr().Get()[0]),
                      "extent": [list(x) for x in c.GetExtentAttr().Get()], "library_extent": [list(x) for x in right]})
    return found


def main():
    stage = Usd.Stage.Open(sys.argv[1])
    tiles = UsdGeom.PointInstancer(stage.GetDefaultPrim().GetChild("Tiles"))
    assert set(tiles.GetProtoIndicesAttr().Get()) == {0}
    (tile,) = tiles.GetPrototypesRel().GetTargets()
    sheet = UsdGeom.Mesh.Get(stage, "/Cloth/Sheet")
    camera = UsdGeom.Camera.Get(stage, "/View/Camera").GetCamera()
    lamp = UsdLux.RectLight.Get(stage, "/View/Lamp")
    place = UsdGeom.Xformable(lamp).ComputeLocalToWorldTransform(Usd.TimeCode.Default())
    look = camera.transform.TransformDir(Gf.Vec3d(0, 0, -1))
    print(json.dumps({
        "unit_m": UsdGeom.GetStageMetersPerUnit(stage), "up": UsdGeom.GetStageUpAxis(stage), "curves": curves_of(stage, tile),
        "instances": [list(p) for p in tiles.GetPositionsAttr().Get()], "sheet": [list(p) for p in sheet.GetPointsAttr().Get()],
        "sheet_surface": surface_of(sheet.GetPrim()),
        "camera": {"at": list(camera.transform.ExtractTranslation()), "look": list(look), "fov_deg": camera.GetFieldOfView(camera.FOVHorizontal)},
        "lamp": {"at": list(place.ExtractTranslation()), "look": list(place.TransformDir(Gf.Vec3d(0, 0, -1))),
                 "side": lamp.GetWidthAttr().Get(), "radiance": lamp.GetIntensityAttr().Get()}}))


if __name__ == "__main__":
    main()
