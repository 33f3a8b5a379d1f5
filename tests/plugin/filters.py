"""The filters, reader, writer and extractor as a script's author uses them, also with bad input."""

import json
import os

import numpy as np
from pvtest import *  # noqa: F403
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonDataModel import vtkFieldData
from vtkmodules.vtkRenderingCore import vtkCamera

POSITION, FOCAL_POINT = [60, 45, 75], [0, 0, 0]


def with_camera(proxy):
    proxy.CameraPosition, proxy.CameraFocalPoint = POSITION, FOCAL_POINT
    return proxy


def vdi_of(source, array=("POINTS", "RTData"), **properties):
    return filter_with(source, *array, **{"CameraPosition": POSITION, "CameraFocalPoint": FOCAL_POINT,
                                          "Resolution": [120, 90], **properties})


wavelet = simple.Wavelet(WholeExtent=[-12, 12, -12, 12, -12, 12])
image = vdi_of(wavelet)
flat = picture(image)
check(flat.max() > 60, "an image in, a picture out")
check(image.LookupTable is not None, "the colour map is the array's own when none is given")
names = [image.GetPointDataInformation().GetArray(i).Name for i in range(2)]
check(names == ["RGBA", "SupersegmentCount"], "point data: RGBA and SupersegmentCount")
image.SMProxy.UpdatePropertyInformation()
check("generate" in image.SMProxy.GetProperty("Report").GetElement(0), "the report tells what each stage took")


def last_vdi(proxy):
    """The figures on which the panel's estimate is based."""
    proxy.SMProxy.UpdatePropertyInformation()
    numbers = proxy.SMProxy.GetProperty("LastVdi")
    return [numbers.GetElement(i) for i in range(numbers.GetNumberOfElements())]


# The figures on which the panel's estimate is based.
last = last_vdi(image)
fields = image.GetClientSideObject().GetOutputDataObject(0).GetFieldData()
segments = fields.GetArray("VDI.codes").GetNumberOfTuples()
check(last[:4] == [120, 90, 0, 25] and last[4] in (1, 2, 4) and last[5:14] == [1, 1, 0, 1, 1, 1, 0, 0, 1] and
      last[14:16] == [120 * 90, segments],
      "the last VDI's numbers are those of its settings and lists: {}".format(last))
check(last[16] > 0 and last[17] >= 0, "the last VDI's numbers say what it took")
image.Resolution, image.Margin, image.Precision = [240, 180], 0.25, 0
image.UpdatePipeline()
larger = last_vdi(image)
check(larger[0:3] == [240, 180, 0.25] and larger[9] == 0, "the numbers become those of the next VDI")
growth = larger[14] / last[14]
check(growth >= 4 and abs(larger[15] / last[15] / growth - 1) < 0.1,
      "supersegments grow with lists: {:.2f} times as many in {:.2f}".format(larger[15] / last[15], growth))
image.Resolution, image.Margin, image.Precision = [120, 90], 0, 1
image.UpdatePipeline()
check(last_vdi(simple.VolumetricDepthImage(Input=wavelet)) == [0] * len(last), "without a VDI there is nothing to go by")


def check_stored_ranges():
    """ParaView's server asks a data set's field data for the ranges of all arrays after each update.
    These must be known then. The test overwrites the values without telling VTK, which would find
    other ranges in them."""
    image = vdi_of(wavelet, Precision=0)
    image.UpdatePipeline()
    data = image.GetClientSideObject().GetOutputDataObject(0)
    arrays = [data.GetPointData().GetArray(name) for name in ("RGBA", "SupersegmentCount")]
    arrays += [data.GetFieldData().GetArray(name) for name in ("VDI.offsets", "VDI.supersegments")]
    for array in arrays:
        values = vtk_to_numpy(array)
        values = values.reshape(len(values), -1)
        lengths = np.linalg.norm(values.astype(float), axis=1)
        expected = [(lengths.min(), lengths.max())] if values.shape[1] > 1 else []
        expected += [(column.min(), column.max()) for column in values.T]
        values[...] = 0
        fresh = vtkFieldData()
        fresh.AddArray(array)
        components = range(-1 if values.shape[1] > 1 else 0, values.shape[1])
        for find in (fresh.GetRange, fresh.GetFiniteRange):
            found = [[0, 0] for _ in components]
            for component, pair in zip(components, found):
                find(array.GetName(), pair, component)
            check(np.allclose(found, expected, rtol=1e-6), "the ranges of %s are stored with it" % array.GetName())


check_stored_ranges()

# Saved, read again, rendered: the same.
path = os.path.join(OUTPUT, "wavelet.vdi")
simple.SaveData(path, proxy=image)
read = simple.OpenDataFile(path)
check(np.array_equal(picture(read), flat), "a saved VDI reads back as it was")
read.SMProxy.UpdatePropertyInformation()
viewpoint = [read.SMProxy.GetProperty("Viewpoint").GetElement(i) for i in range(12)]
check(np.allclose(viewpoint[:6], list(POSITION) + list(FOCAL_POINT)), "a saved VDI says where it was made from")
for source in (image, read):
    rendered = with_camera(simple.RenderVDI(Input=source))
    worst = np.abs(picture(rendered).astype(int) - flat).max()
    check(worst <= 2, "RenderVDI from V_O gives the flat picture, off by %d" % worst)

# The same VDI, saved as a page for browsers.
page = os.path.join(OUTPUT, "wavelet.html")
simple.SaveData(page, proxy=image)
read = simple.OpenDataFile(vdi_in_page(page, os.path.join(OUTPUT, "wavelet_page.vdi")))
check(np.array_equal(picture(read), flat), "a page has the VDI")
extractor = simple.CreateExtractor("VDIPage", image, registrationName="page")
extractor.Writer.FileName = "extracted_{timestep:03d}.html"
simple.SaveExtracts(ExtractsOutputDirectory=OUTPUT)
read = simple.OpenDataFile(vdi_in_page(os.path.join(OUTPUT, "extracted_000.html"), os.path.join(OUTPUT, "extracted.vdi")))
check(np.array_equal(picture(read), flat), "an extracted page has the VDI")
simple.Delete(extractor)
nowhere = os.path.join(OUTPUT, "no", "folder", "x.html")
check(errors_of(lambda: simple.SaveData(nowhere, proxy=image)), "a page that can't be written is an error")

rendered.Resolution = [64, 64]
check(picture(rendered).shape == (64, 64, 3), "RenderVDI renders at any resolution")
volume = picture(vdi_of(wavelet, PictureOnly=1)).astype(int)
# Straight colour and opacity are bytes, each within 1 of the volume's: over black that makes 2.
worst = np.abs(volume - flat).max()
check(worst <= 2, "from V_O a VDI is the volume's own picture, off by %d" % worst)
for precision in ("Full", "Compact"):
    searched = picture(vdi_of(wavelet, Algorithm="Bisection", Supersegments=2, Precision=precision))
    worst = np.abs(searched - volume).max()
    check(worst <= 2,
          "from V_O a VDI by bisection, in %s precision, is the volume's own picture, off by %d" % (precision.lower(), worst))

# Zoomed in, a margin keeps what lies beyond the picture; the picture stays.
near = {"CameraViewAngle": 6, "Resolution": [60, 45]}
cut, kept = vdi_of(wavelet, **near), vdi_of(wavelet, Margin=1, **near)
check(np.array_equal(picture(kept), picture(cut)), "a margin leaves the picture as it is")
path = os.path.join(OUTPUT, "margin.vdi")
simple.SaveData(path, proxy=kept)
read_again = simple.OpenDataFile(path)
check(np.array_equal(picture(read_again), picture(cut)), "a VDI with a margin reads back as it was")
turned = [picture(simple.RenderVDI(Input=source, UseOriginalCamera=1, Azimuth=20))
          for source in (cut, kept, read_again)]
check(all(view.shape == (45, 60, 3) for view in turned), "views are of the picture's size by default")
check(np.array_equal(turned[1], turned[2]), "the margin is in the file")
black = [np.mean(view.max(axis=2) == 0) for view in turned]
check(black[0] > 0.01 and black[1] < 0.001, "turned by 20 degrees, %.1f %% are missing without, %.1f %% with it"
      % (100 * black[0], 100 * black[1]))

by_need = vdi_of(wavelet, Supersegments=6, Budget="Total", Fill=0.5)
check(np.abs(picture(by_need) - volume).max() <= 2, "from V_O a VDI with a total budget is the volume's own picture")
equal_share = vdi_of(wavelet, Supersegments=6)


def supersegments(vdi):
    vdi.UpdatePipeline()
    data = vdi.GetClientSideObject().GetOutput().GetPointData()
    return vtk_to_numpy(data.GetArray("SupersegmentCount")).astype(int)


share = supersegments(by_need).sum() / supersegments(equal_share).sum()
check(0.4 < share < 0.6, "a total budget that is filled by half makes half of the supersegments, %.2f" % share)
check(len(np.unique(supersegments(by_need))) > 3, "lists hold as many as they need")
full = vdi_of(wavelet, Precision="Full", TerminationOpacity=0.9999)  # as PictureOnly ends its rays
check(np.array_equal(picture(full), volume), "full precision gives the same picture to the bit")
check(picture(with_camera(simple.RenderVDI(Input=full))).max() > 60, "a VDI of full precision is rendered")
rendered = {
    name: picture(simple.RenderVDI(Input=full, UseOriginalCamera=1, Azimuth=10, Reconstruction=name))
    for name in ("Sheared", "Smooth", "Constant")
}
apart = np.abs(rendered["Smooth"].astype(int) - rendered["Constant"]).mean()
leaning = np.abs(rendered["Smooth"].astype(int) - rendered["Sheared"]).mean()
check(0 < leaning < 4, "faces lean a little, by %.2f on average" % leaning)
check(0 < apart < 4, "reconstructions are alike but not equal, off by %.2f on average" % apart)

# Azimuth is vtkCamera's, also where view-up isn't orthogonal to the view direction. (position, view-up, degrees)
OBLIQUE = ([0, 34, 94], [0, 1, 0], 50), ([60, 45, 75], [0.6, 1.6, -0.8], 50), ([60, 45, 75], [-0.2, 0.1, 0.3], -35)
for position, view_up, degrees in OBLIQUE:
    oblique = vdi_of(wavelet, CameraPosition=position, CameraViewUp=view_up)
    camera = vtkCamera()
    camera.SetPosition(position)
    camera.SetFocalPoint(FOCAL_POINT)
    camera.SetViewUp(view_up)
    camera.Azimuth(degrees)
    there = dict(CameraPosition=camera.GetPosition(), CameraFocalPoint=FOCAL_POINT, CameraViewUp=camera.GetViewUp())
    turned = picture(simple.RenderVDI(Input=oblique, UseOriginalCamera=1, Azimuth=degrees)).astype(int)
    worst = np.abs(turned - picture(simple.RenderVDI(Input=oblique, **there))).max()
    check(worst <= 1, "azimuth is vtkCamera's from %s with view-up %s, off by %d" % (position, view_up, worst))
    similar = ssim(turned.astype(np.uint8), picture(vdi_of(wavelet, PictureOnly=1, **there)))
    check(similar > 0.97, "a turned view is volume rendering from there, SSIM %.4f" % similar)

# A series of files has time steps.
second = os.path.join(OUTPUT, "series_1.vdi")
simple.SaveData(os.path.join(OUTPUT, "series_0.vdi"), proxy=image)
simple.SaveData(second, proxy=vdi_of(wavelet, Supersegments=3))
series = simple.VDIReader(FileNames=[os.path.join(OUTPUT, "series_0.vdi"), second])
series.UpdatePipelineInformation()
check(len(series.TimestepValues) == 2, "a series of files is a series of time steps")
check(not image.GetDataInformation().DataInformation.GetHasTime(), "data without a time give a VDI without one")

# Times are the files', whatever can be read of them.
timed = simple.TrivialProducer()
TIMES = [2.0, 4.5, 5.0, 7.0]
names = [os.path.join(OUTPUT, "timed_%d.vdi" % step) for step in range(4)]
pictures = []
for step, step_time in enumerate(TIMES):
    data = vtkImageData()
    data.DeepCopy(wavelet.GetClientSideObject().GetOutputDataObject(0))
    data.GetInformation().Set(data.DATA_TIME_STEP(), step_time)
    timed.GetClientSideObject().SetOutput(data)
    timed.MarkModified(timed.SMProxy)
    vdi = vdi_of(timed, CameraPosition=[60, 45 - 20 * step, 75])
    pictures.append(picture(vdi))
    simple.SaveData(names[step], proxy=vdi)
with open(os.path.join(OUTPUT, "timed.vdi.series"), "w") as listing:
    json.dump({"file-series-version": "1.0",
               "files": [{"name": "timed_%d.vdi" % step, "time": 10.0 * step} for step in range(4)]}, listing)


def times_of(proxy):
    proxy.UpdatePipelineInformation()
    return list(proxy.TimestepValues)


def shown_at(proxy, at):
    proxy.UpdatePipeline(at)
    data = proxy.GetClientSideObject().GetOutputDataObject(0)
    if data.GetNumberOfPoints() == 0:
        return None
    rgba = vtk_to_numpy(data.GetPointData().GetArray("RGBA")).reshape(90, 120, 4).astype(float)
    return np.flipud(np.rint(rgba[..., :3] * rgba[..., 3:] / 255)).astype(np.uint8)


listed = simple.OpenDataFile(listing.name)
check(times_of(listed) == [0, 10, 20, 30], "a .vdi.series file has the times that it says %s" % times_of(listed))
check(all(np.array_equal(shown_at(listed, 10.0 * step), pictures[step]) for step in (3, 0, 2)),
      "a .vdi.series file has the pictures of its times")
opened = simple.VDIReader(FileNames=names)
check(times_of(opened) == TIMES, "a series has its files' times")
check(np.array_equal(shown_at(opened, 4.5), pictures[1]), "a series has its files' pictures")
os.remove(names[1])
opened.MarkModified(opened.SMProxy)
check(times_of(opened) == TIMES, "a file that goes leaves its time")
later = simple.VDIReader(FileNames=names)
check(times_of(later) == [2, 3.5, 5, 7], "a file that was never there gets a time between the others', %s" % times_of(later))
for what, proxy, missing in (("that goes", opened, 4.5), ("that was never there", later, 3.5)):
    check(np.array_equal(shown_at(proxy, 5.0), pictures[2]), "the other files are shown in spite of one " + what)
    said = errors_of(lambda: proxy.UpdatePipeline(missing))
    check(len(said) == 1, "a file %s is one error, %d" % (what, len(said)))
    check(shown_at(proxy, missing) is None and np.array_equal(shown_at(proxy, 7.0), pictures[3]),
          "a file %s loses only its own step" % what)
os.remove(names[0])
first_lost = simple.VDIReader(FileNames=names[:1] + names[2:])
check(times_of(first_lost) == [3, 5, 7],
      "a missing first file gets a time before the others', %s" % times_of(first_lost))
check(np.array_equal(shown_at(first_lost, 5.0), pictures[2]), "the other files are shown where the first one is missing")


# Values are uploaded when they're new, and only then.
def upload_seconds(proxy):
    proxy.UpdatePipeline()
    proxy.SMProxy.UpdatePropertyInformation()
    header, row = proxy.SMProxy.GetProperty("Report").GetElement(0).splitlines()[:2]
    return float(row.split()[3])


def changed_by(proxy, change):
    before = picture(proxy).astype(int)
    change()
    return np.abs(picture(proxy) - before).max()


grid = vtkImageData()
grid.SetDimensions(64, 64, 64)
grid.SetSpacing(0.4, 0.4, 0.4)
values = 40 + 230 * np.random.RandomState(5).rand(64 ** 3)  # the wavelet's range
in_place = numpy_to_vtk(values)  # shares the memory, as a simulation's arrays do
in_place.SetName("RTData")
grid.GetPointData().SetScalars(in_place)
producer = producer_of(grid)
watched = vdi_of(producer, CameraFocalPoint=[12, 12, 12])
check(upload_seconds(watched) > 0, "new values take an upload")
check(changed_by(watched, lambda: setattr(watched, "CameraPosition", [50, 60, 75])) > 8, "another camera: another picture")
check(upload_seconds(watched) == 0, "another camera takes no upload")


def overwrite(*modified):
    values[:] = np.roll(values, 1000)
    for thing in modified:
        thing.Modified()
    producer.MarkModified(producer.SMProxy)


check(changed_by(watched, lambda: overwrite(in_place)) > 8, "values overwritten in an array: another picture")
check(changed_by(watched, lambda: overwrite(producer.GetClientSideObject())) > 8,
      "values that only their source reports as new: another picture")
check(changed_by(watched, lambda: setattr(watched, "FillGhosts", 0)) == 0, "ghost layers that no block lacks change nothing")
check(changed_by(watched, lambda: setattr(watched, "Input", wavelet)) > 8, "another input: another picture")

# Composite and cell data.
cells = simple.PointDatatoCellData(Input=wavelet)
check(picture(vdi_of(cells, ("CELLS", "RTData"))).max() > 60, "cell data")
group = vdi_of(simple.GroupDatasets(Input=[wavelet]))
check(not errors_of(group.UpdatePipeline), "a multiblock makes no errors")
check(np.array_equal(picture(group), flat), "a multiblock of one image gives the image's picture")
amr = simple.HierarchicalFractal(Dimensions=8, TwoDimensional=0, Asymetric=0)
fractal = vdi_of(amr, ("CELLS", "Fractal Volume Fraction"), CameraPosition=[8, 6, 9], CameraFocalPoint=[0, 0, 0])
check(picture(fractal).max() > 60, "an AMR data set of " + amr.GetClientSideObject().GetOutputDataObject(0).GetClassName())

# An abort leaves the previous picture.
aborted = vdi_of(wavelet)
kept = picture(aborted)
algorithm = aborted.GetClientSideObject()
observer = algorithm.AddObserver("ProgressEvent", lambda *_: algorithm.SetAbortExecuteAndUpdateTime())
aborted.CameraPosition = [50, 60, 75]
check(np.array_equal(picture(aborted), kept), "an abort leaves the previous picture")
algorithm.RemoveObserver(observer)
algorithm.SetAbortExecute(0)
aborted.CameraPosition = [50, 60, 76]
check(not np.array_equal(picture(aborted), kept), "after an abort, the next VDI is made")

# Bad input: an error, not a crash, and the next thing works.
check(errors_of(lambda: vdi_of(simple.Tetrahedralize(Input=wavelet)).UpdatePipeline()), "an unstructured grid is refused")
plane = simple.Wavelet(WholeExtent=[0, 9, 0, 9, 3, 3])
check(not errors_of(lambda: vdi_of(plane).UpdatePipeline()), "data of one point along an axis are a sheet")
check(errors_of(lambda: vdi_of(wavelet, CameraViewAngle=0).UpdatePipeline()), "a camera without an angle of view is refused")
check(errors_of(lambda: vdi_of(wavelet, ("POINTS", "nothing")).UpdatePipeline()), "a missing array is refused")
check(errors_of(lambda: simple.RenderVDI(Input=wavelet).UpdatePipeline()), "RenderVDI refuses an image that is no VDI")
broken = os.path.join(OUTPUT, "broken.vdi")
content = bytearray(open(path, "rb").read())
content[len(content) // 2] ^= 0x10
open(broken, "wb").write(content)
check(errors_of(lambda: simple.VDIReader(FileNames=[broken]).UpdatePipeline()), "a file with a flipped bit is refused")
check(np.array_equal(picture(vdi_of(wavelet)), flat), "after all that, a VDI is made as before")

# The script brings its own all() and max().
holes = simple.ProgrammableFilter(Input=wavelet)
holes.Script = """
for name, fill in (("filled", -9999), ("nan", float("nan"))):
    values = inputs[0].PointData["RTData"].copy()
    values[values > 200] = fill
    output.PointData.append(values, name)
"""
unmarked = vdi_of(holes, ("POINTS", "nan"))
marked = vdi_of(holes, ("POINTS", "filled"), MissingValues=[1e20, -9999])
for one in (unmarked, marked):
    one.UpdatePipeline()
    one.LookupTable.RescaleTransferFunction(40, 200)
    simple.GetOpacityTransferFunction(one.SelectInputScalars[1]).RescaleTransferFunction(40, 200)
seen = picture(unmarked)
check(np.array_equal(picture(marked), seen) and seen.max() > 60, "missing values are transparent, as NaN is")
ranges = [one.FieldData[name].GetRange() for one, name in ((unmarked, "nan"), (marked, "filled"))]
check(ranges[0] == ranges[1] and ranges[0][0] > 0, "they don't count in the range of the values shown: %s" % ranges)
marked.MissingValues = []
check(not np.array_equal(picture(marked), seen), "they are values like others where no number stands for them")
finish()
