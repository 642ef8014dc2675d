"""Tools for gyronet in Python: import of logs (`gyronet.logs`) and wheel settings from DBC files (`gyronet.wheels`)."""
