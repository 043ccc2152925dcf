// A rounded foot on a pad [mm]: cross-sections of quadrilaterals, extruded to elements.
DefineConstant[ size = { 2.5, Name "size" } ]; // of the elements, far from the contact

radius = 20;
depth = 12;
// The foot: a segment of a disc. Gmsh would merge points of the foot and of the pad that coincide.
gap = 0.02;
half = 12;
edge = gap + radius - Sqrt(radius^2 - half^2);
Point(1) = {0, 0, gap, size/5};
Point(2) = {half, 0, edge, size};
Point(3) = {half, 0, 14, size};
Point(4) = {-half, 0, 14, size};
Point(5) = {-half, 0, edge, size};
Point(6) = {0, 0, gap + radius, size};
Circle(1) = {5, 6, 1};
Circle(2) = {1, 6, 2};
Line(3) = {2, 3};
Line(4) = {3, 4};
Line(5) = {4, 5};
Curve Loop(1) = {1, 2, 3, 4, 5};
Plane Surface(1) = {1};

// The pad.
width = 20;
height = 8;
Point(11) = {-width, 0, -height, size};
Point(12) = {width, 0, -height, size};
Point(13) = {width, 0, 0, size};
Point(14) = {0, 0, 0, size/5};
Point(15) = {-width, 0, 0, size};
Line(11) = {11, 12};
Line(12) = {12, 13};
Line(13) = {13, 14};
Line(14) = {14, 15};
Line(15) = {15, 11};
Curve Loop(2) = {11, 12, 13, 14, 15};
Plane Surface(2) = {2};

foot[] = Extrude {0, depth, 0} { Surface{1}; Layers{ Ceil(depth/size) }; Recombine; };
pad[] = Extrude {0, depth, 0} { Surface{2}; Layers{ Ceil(depth/size) }; Recombine; };

// Names, which the deck uses. foot[1] is the volume; foot[2], foot[3], ... lie on the curves 1, 2, ...
Physical Volume("FOOT") = {foot[1]};
Physical Volume("PAD") = {pad[1]};
Physical Surface("ROUND") = {foot[2], foot[3]};
Physical Surface("GRIP") = {foot[5]};
Physical Surface("BASE") = {pad[2]};
Physical Surface("TREAD") = {pad[4], pad[5]};

Mesh.ElementOrder = 1;
Mesh.RecombineAll = 1;
Mesh.RecombinationAlgorithm = 3; // nothing but quadrilaterals
Mesh.SaveGroupsOfNodes = 1;      // sets of nodes beside those of elements
