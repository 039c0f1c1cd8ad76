"""The same networks without the native runtime, as people would run them otherwise.

``numpy_fmu`` is an FMU of PythonFMU with numpy; ``layers`` and ``cells`` are torch and onnxruntime
in process, on one thread. Packages are imported where they are needed: a baseline whose package is
not installed is an ImportError, a network that it does not know a ``BaselineError``.
"""


class BaselineError(ValueError):
    """A baseline does not know such a network."""
