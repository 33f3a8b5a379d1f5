"""Checks that the files of several ranks equal those of one, and change from step to step. Arguments: the folders."""

import sys

import pv_vdi

one, several = ([pv_vdi.read("%s/vdi_%06d.vdi" % (folder, step)) for step in (1, 2)] for folder in sys.argv[1:])
for alone, together in zip(one, several):
    difference = abs(alone.render()[0] - together.render()[0]).max()
    assert alone.offsets[-1] > 1000 and difference <= 2 / 255, difference
    assert alone.time == together.time == 0.5 * alone.time_step, alone.time
    assert alone.metadata["array"]["name"] == "V", alone.metadata
assert abs(one[0].render()[0] - one[1].render()[0]).max() > 0.05
