"""A Catalyst script with arguments: --name NAME gives the files' names. Each step checks the arrays that it gets."""

from paraview import catalyst
from paraview.simple import *  # noqa: F403
from vtkmodules.util.numpy_support import vtk_to_numpy

TYPES = {"u8": "uint8", "i8": "int8", "u16": "uint16", "i16": "int16", "u32": "uint32", "i32": "int32",
         "u64": "uint64", "i64": "int64", "f32": "float32", "f64": "float64"}

arguments = catalyst.get_args()
assert len(arguments) == 2 and arguments[0] == "--name", arguments
grid = TrivialProducer(registrationName="grid")
image = VolumetricDepthImage(Input=grid)
image.SelectInputScalars = ["CELLS", "V"]
image.Resolution = [64, 48]
extractor = CreateExtractor("VDI", image, registrationName="vdi")
extractor.Writer.FileName = arguments[1] + "_{timestep}.vdi"
options = catalyst.Options()
options.ExtractsOutputDirectory = "."


def catalyst_execute(info):
    grid.UpdatePipeline()
    cells = grid.GetClientSideObject().GetOutputDataObject(0).GetPartition(0).GetCellData()
    names = [cells.GetArrayName(i) for i in range(cells.GetNumberOfArrays())]
    assert sorted(names) == sorted(["V", *TYPES]), names
    for name, kind in TYPES.items():
        values = vtk_to_numpy(cells.GetArray(name))
        assert values.dtype == kind, (name, values.dtype)
        assert len(values) > 1000 and all(values[i] == i % 100 for i in range(0, len(values), 37)), name
