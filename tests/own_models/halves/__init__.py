"""A quarter car cut in two, as FMUs of PythonFMU, and the whole as truth."""
