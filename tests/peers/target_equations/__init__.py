"""Equations of the target as a test: the equations that each program forms from its file, compared with the equations of motion of all nodes of the model.

`oracle` has the equations of all nodes, from K, M and positions alone. Each reader of a format (`exudyn`, `sid`, `mbdyn`, `mbsim`, `openradioss`, `adams`, `arrays`, `embedded`, `matrices`,
`pictures`) has the equations that its program publishes, from the file alone. `checks` compares both, `bodies` makes bodies and files, `table` runs all of it and `selftest` shows that
the checks can fail:

    python3 tests/peers/suite.py --only equations

The modes are those of the file where the file has them at the nodes; the oracle finds them mass-normalised (column "shapes"). The frame is the one in which the nodes of the file lie where
those of the model do.
"""
