"""In pvbatch: the installed plugin is listed, and loads by its name."""

from paraview import simple

simple.LoadDistributedPlugin("VolumetricDepthImages")
image = simple.VolumetricDepthImage(Input=simple.Wavelet())
image.Resolution = [64, 48]
image.CameraPosition = [60, 45, 75]
image.UpdatePipeline()
if image.PointData["SupersegmentCount"].GetRange()[1] <= 0:
    raise SystemExit("FAILED: an empty VDI")
