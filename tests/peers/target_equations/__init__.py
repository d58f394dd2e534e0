"""Equations of the target as a test: what each program makes of its file, beside the equations of motion of all nodes of the model.

`oracle` has the equations of all nodes, from K, M and positions alone. Each of the other modules reads one format with the equations that its program publishes, from the file
alone; `checks` holds one to the other, `bodies` makes the bodies and files, and `table` runs all of it. `rows` and `some` are called by suite.py:

    python3 tests/peers/suite.py --only equations

The modes are those of the file where the file has them at the nodes; the oracle finds them mass-normalised (column "shapes"), and the frame is the one in which the nodes of the file are those
of the model.
"""
