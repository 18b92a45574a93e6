"""Two faults of the Reference FMU StateSpace (FMI 3.0), seen with FMPy; tests/validate/three.rs expects them.

Usage: .venv/bin/python scripts/oracles/state_space.py ../shared/fmus/fmi3/StateSpace.fmu
"""
import sys

from fmpy import extract, read_model_description
from fmpy.fmi1 import FMICallException
from fmpy.fmi3 import FMU3Slave

path = sys.argv[1]
description = read_model_description(path)
fmu = FMU3Slave(guid=description.instantiationToken, unzipDirectory=extract(path), modelIdentifier="StateSpace", instanceName="i")
fmu.instantiate()
fmu.enterConfigurationMode()
try:
    fmu.setUInt64([1], [3])
    print("m = 3 is taken in configuration mode")
except FMICallException as error:
    print(f"m = 3 is refused in configuration mode: {error}")
fmu.reset()
fmu.setFloat64([8], [0.05, 0.05, 0.05])
fmu.enterInitializationMode(startTime=0.0)
fmu.exitInitializationMode()
fmu.reset()
fmu.enterInitializationMode(startTime=0.0)
fmu.exitInitializationMode()
print("x0 after a reset, 0 0 0 in modelDescription.xml:", *fmu.getFloat64([8], 3))
