"""Properties of ParaView's Volume representation that change which scalars a view shows: the first update takes them over,
and the picture is ParaView's own."""

import numpy as np
from pvtest import *  # noqa: F403
from vtkmodules.util.numpy_support import numpy_to_vtk

SIDE, UNIT = 24, 2.0


def compare(source, view, name, what, expected, least, **shown):
    """Takes over what the view shows with these properties, which the filter then has as `expected`."""
    theirs = paraview_volume(source, view, "POINTS", name, UNIT, keep_range=True, **shown)
    simple.SetActiveView(view)
    image = vdi_filter(source, view, "POINTS", name, 0, Resolution=[0, 0])  # the unit distance is taken, too
    ours = picture(image)
    has = {key: getattr(image, key) for key in expected}
    check(has == expected, "%s: the first update takes %s" % (what, has))
    off = np.abs(ours.astype(float) - theirs).mean()
    check(theirs.max() > 100 and ssim(ours, theirs) >= least and off < 1 and wrong_share(ours, theirs) < 0.01,
          "%s: SSIM with ParaView's own %.4f, mean difference %.2f" % (what, ssim(ours, theirs), off))
    write_png("properties_%s.png" % what.replace(" ", "_"), np.hstack([ours, theirs]))
    simple.Delete(image)
    return ours, theirs


# Blocks of labels 0, 1 and 3. Only label 2 is green.
z, y, x = np.meshgrid(*[np.arange(SIDE)] * 3, indexing="ij")
labels = np.array([0, 1, 3], np.uint8)[(x // 6 + y // 6 + z // 6) % 3]
source, center = source_of_values(labels, "labels")
view = make_view([240, 240], list(center + [30, 20, 55]), list(center))
colors, opacity = simple.GetColorTransferFunction("labels"), simple.GetOpacityTransferFunction("labels")
colors.ColorSpace = "RGB"
colors.RGBPoints = [0, 1, 0, 1, 0.45, 1, 0, 1, 0.55, 1, 0, 0, 1.45, 1, 0, 0,
                    1.55, 0, 1, 0, 2.45, 0, 1, 0, 2.55, 0, 0, 1, 4, 0, 0, 1]
opacity.Points = [0, 0, 0.5, 0, 0.45, 0, 0.5, 0, 0.55, 0.3, 0.5, 0, 1.45, 0.3, 0.5, 0, 1.55, 0.6, 0.5, 0, 2.45, 0.6, 0.5, 0,
                  2.55, 0.2, 0.5, 0, 4, 0.2, 0.5, 0]
for shade in (0, 1):
    ours, theirs = compare(source, view, "labels", "nearest, shaded" if shade else "nearest", {"InterpolationType": "Nearest"},
                           0.99, InterpolationType="Nearest", Shade=shade)
    check(ours[..., 1].max() == 0 and theirs[..., 1].max() == 0, "nearest labels: none is green")

# Components together: red, green, blue and opacity, or colour and opacity. Neither opacities nor doubles' colours fill
# their types' ranges, as Volume stretches both then.
fields = [waves((SIDE,) * 3, spacing) / 255 for spacing in ((3, 2, 4), (2, 4, 3), (4, 3, 2), (5, 5, 4))]
RGBA, PAIR = [0.1 + 0.8 * field for field in fields], [0.5 + fields[0], 0.2 + 0.6 * fields[3]]
# Before 5.13, Volume shades by the gradient of red.
SHADED = [RGBA[3], *RGBA[1:]]
for name, components, kind, scale, shown in (
        ("rgba", RGBA, "uint8", 255, {"MapScalars": 0}), ("rgba floats", RGBA, "float32", 1, {"MultiComponentsMapping": 1}),
        ("rgba doubles", RGBA, "float64", 1, {"MapScalars": 0}),
        ("rgba shaded", SHADED, "uint16", 65535, {"MapScalars": 0, "Shade": 1}),
        ("pair", PAIR, "float32", 10, {"MapScalars": 0})):
    simple.Hide(source, view)
    image = image_of(labels, "labels")
    array = numpy_to_vtk((np.stack([field.ravel() for field in components], axis=1) * scale).astype(kind), deep=True)
    array.SetName(name)
    image.GetPointData().AddArray(array)
    source = producer_of(image)
    source.UpdatePipeline()
    set_colors(name, 0, scale)
    compare(source, view, name, name, {"Component": -3, "ScalarOpacityUnitDistance": 1}, 0.99, **shown)
said = errors_of_update(vdi_filter(source, view, "POINTS", "labels", UNIT, Component=-3))
check("they must be two, colour and opacity, or four" in said, "one component isn't taken together: " + said)

# Each property of ParaView's representation of uniform grids, 5.11 to 6.1: what the filter makes of it. A new version's
# properties are added here, and where the filter can't honour them, to displayIssues.
honoured = """Ambient BlendMode ColorArrayName CroppingOrigin CroppingScale Diffuse InterpolationType IsosurfaceValues
              LookupTable ScalarOpacityFunction ScalarOpacityUnitDistance Shade UseCropping"""
said = """CoordinateSystem GlobalIlluminationReach MapScalars MultiComponentsMapping Orientation Position Translation Scale
          Specular UseSeparateOpacityArray UseTransfer2D VolumeAnisotropy VolumetricScatteringBlending"""
of_those_said = """ColorArray2Component ColorArray2Name OpacityArrayName OpacityComponent Origin SliceFunction SpecularPower
                   TransferFunction2D UseGradientForTransfer2D"""  # they count only beside one of those, or a blend mode
no_look = "DummyInput ForceUseCache ForcedCacheKey Input Pickable Visibility VolumeRenderingMode"
proxy = simple.servermanager.ProxyManager().SMProxyManager.NewProxy("representations", "UniformGridVolumeRepresentation")
names, each = set(), proxy.NewPropertyIterator()
each.Begin()
while not each.IsAtEnd():
    if not each.GetProperty().GetInformationOnly():
        names.add(each.GetKey())
    each.Next()
silent = names - set((honoured + " " + said + " " + of_those_said + " " + no_look).split())
check(len(names) > 30 and not silent, "properties of volumes that the filter ignores without a word: %s" % sorted(silent))
finish()
