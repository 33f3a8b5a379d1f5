"""Properties of ParaView's Volume representation that change which scalars a view shows: the first update takes them over,
and the picture is ParaView's own."""

import numpy as np
from pvtest import *  # noqa: F403

SIDE, UNIT = 24, 2.0


def compare(source, view, name, what, expected, least, **shown):
    """Takes over what the view shows with these properties, which the filter then has as `expected`."""
    theirs = paraview_volume(source, view, "POINTS", name, UNIT, keep_range=True, **shown)
    simple.SetActiveView(view)
    image = vdi_filter(source, view, "POINTS", name, UNIT, Resolution=[0, 0])
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

# Each property of ParaView's representation of uniform grids, 5.11 to 6.1: what the filter makes of it. A new version's
# properties are added here, and where the filter can't honour them, to displayIssues.
honoured = """Ambient BlendMode ColorArrayName CroppingOrigin CroppingScale Diffuse InterpolationType IsosurfaceValues
              LookupTable ScalarOpacityFunction ScalarOpacityUnitDistance Shade UseCropping"""
said = """GlobalIlluminationReach MapScalars MultiComponentsMapping Orientation Position Translation Scale Specular
          UseSeparateOpacityArray UseTransfer2D VolumeAnisotropy VolumetricScatteringBlending"""
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
