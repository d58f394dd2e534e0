SetFactory("OpenCASCADE");
// An angle bracket of steel, in millimetres: a foot with two holes for bolts, a wall with a bore for a pin.
thickness = 8; width = 40; length = 60; height = 50;
Box(1) = {0, -width / 2, 0, length, width, thickness};
Box(2) = {0, -width / 2, 0, thickness, width, height};
BooleanUnion(3) = { Volume{1}; Delete; }{ Volume{2}; Delete; };
Cylinder(4) = {40, -10, -1, 0, 0, thickness + 2, 4};
Cylinder(5) = {40, 10, -1, 0, 0, thickness + 2, 4};
Cylinder(6) = {-1, 0, 32, thickness + 2, 0, 0, 8};
BooleanDifference(7) = { Volume{3}; Delete; }{ Volume{4, 5, 6}; Delete; };

Physical Volume("PART") = {7};
// The faces of the holes become node sets.
eps = 0.01;
Physical Surface("BOLT_A") = Surface In BoundingBox {36 - eps, -14 - eps, -eps, 44 + eps, -6 + eps, thickness + eps};
Physical Surface("BOLT_B") = Surface In BoundingBox {36 - eps, 6 - eps, -eps, 44 + eps, 14 + eps, thickness + eps};
Physical Surface("BORE") = Surface In BoundingBox {-eps, -8 - eps, 24 - eps, thickness + eps, 8 + eps, 40 + eps};

Mesh.MeshSizeMax = 8;
Mesh.MeshSizeFromCurvature = 8;
Mesh.ElementOrder = 2;
Mesh.SaveGroupsOfElements = -1000;
Mesh.SaveGroupsOfNodes = -100;
