// An angle bracket with a fillet and a bolt hole [mm]: any shape, meshed by tetrahedra.
SetFactory("OpenCASCADE");
DefineConstant[ size = { 5, Name "size" } ]; // of the elements

width = 30;
thick = 6;
Box(1) = {0, 0, 0, 40, width, thick};
Box(2) = {0, 0, 0, thick, width, 40};
BooleanUnion(3) = { Volume{1}; Delete; }{ Volume{2}; Delete; };
inner() = Curve In BoundingBox {thick - 0.1, -1, thick - 0.1, thick + 0.1, width + 1, thick + 0.1};
rounded() = Fillet{3}{ inner() }{ 6 };

// The bolt hole, and the ring around it that the washer covers.
hole = 4.5;
washer = 8.5;
Cylinder(10) = {26, width/2, -1, 0, 0, thick + 2, hole};
BooleanDifference(11) = { Volume{rounded()}; Delete; }{ Volume{10}; Delete; };
Disk(1001) = {26, width/2, thick, washer};
Disk(1002) = {26, width/2, thick, hole};
BooleanDifference(1003) = { Surface{1001}; Delete; }{ Surface{1002}; Delete; };
BooleanFragments{ Volume{11}; Delete; }{ Surface{1003}; Delete; }

// Names, which the deck uses: surfaces by boxes that hold them.
eps = 0.1;
Physical Volume("BRACKET") = Volume{:};
Physical Surface("SOLE") = Surface In BoundingBox {-eps, -eps, -eps, 41, width + eps, eps};
Physical Surface("WASHER") = Surface In BoundingBox {26 - washer - eps, width/2 - washer - eps,
  thick - eps, 26 + washer + eps, width/2 + washer + eps, thick + eps};
Physical Surface("BACK") = Surface In BoundingBox {-eps, -eps, -eps, eps, width + eps, 41};

Mesh.MeshSizeMax = size;
Mesh.MeshSizeMin = size/2;
Mesh.MeshSizeFromCurvature = 12; // elements of a full circle
Mesh.ElementOrder = 2;           // 10 nodes, those in the middles of edges on the geometry
Mesh.SaveGroupsOfNodes = 1;      // sets of nodes beside those of elements
