from gyronet._core import Coprocessor as Coprocessor
