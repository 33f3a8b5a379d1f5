"""A script that makes nothing and loads no plugin."""

from paraview import catalyst

options = catalyst.Options()
