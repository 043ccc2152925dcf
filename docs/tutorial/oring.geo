// An O-ring in a groove [mm]: its cross-section, x the radius of the ring, y its axis.
DefineConstant[ size = { 0.4, Name "size" } ]; // of the elements
SetFactory("OpenCASCADE");

radius = 20;  // of the ring's centre line
cord = 3.53;  // diameter of its cord
Disk(1) = {radius, cord/2, 0, cord/2};

Physical Surface("RING") = {1};
Physical Curve("SKIN") = {1};

Mesh.MeshSizeMin = size;
Mesh.MeshSizeMax = size;
Mesh.RecombineAll = 1;
Mesh.ElementOrder = 2;           // 8 nodes, those in the middles of edges on the circle
Mesh.SecondOrderIncomplete = 1;
Mesh.SaveGroupsOfNodes = 1;
