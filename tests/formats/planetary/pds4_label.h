#pragma once

#include <string>
#include <utility>
#include <vector>

namespace isohf::test {

/// What a PDS4 label says of its array.
struct Pds4Options {
  std::string type = "SignedMSB2";
  std::vector<std::pair<std::string, int>> axes = {{"Line", 2}, {"Sample", 3}};
  std::string direction = "Top to Bottom";
  std::string constants = "<missing_constant>-32768</missing_constant>";
};

/// A label of an array in `file` behind two bytes, on a map of Mars.
[[nodiscard]] inline std::string pds4_label(const std::string& file, const Pds4Options& options = {}) {
  std::string axes;
  for (std::size_t i = 0; i < options.axes.size(); ++i) {
    axes += "<Axis_Array><axis_name>" + options.axes[i].first + "</axis_name><elements>" +
            std::to_string(options.axes[i].second) + "</elements><sequence_number>" + std::to_string(i + 1) +
            "</sequence_number></Axis_Array>";
  }
  return "<?xml version=\"1.0\"?>\n<Product_Observational xmlns:cart=\"c\" xmlns:disp=\"d\"><Observation_Area>"
         "<Target_Identification><name>Mars</name></Target_Identification><Discipline_Area><disp:Display_Settings>"
         "<disp:Display_Direction><disp:vertical_display_direction>" +
         options.direction +
         "</disp:vertical_display_direction></disp:Display_Direction></disp:Display_Settings><cart:Cartography>"
         "<cart:Horizontal_Coordinate_System_Definition><cart:Planar><cart:Map_Projection><cart:map_projection_name>"
         "Equirectangular</cart:map_projection_name><cart:Equirectangular><cart:standard_parallel_1>30"
         "</cart:standard_parallel_1><cart:longitude_of_central_meridian unit=\"deg\">20"
         "</cart:longitude_of_central_meridian></cart:Equirectangular></cart:Map_Projection>"
         "<cart:pixel_resolution_x unit=\"km/pixel\">0.1</cart:pixel_resolution_x><cart:pixel_resolution_y "
         "unit=\"m/pixel\">100</cart:pixel_resolution_y><cart:Geo_Transformation><cart:upperleft_corner_x unit=\"m\">"
         "5000</cart:upperleft_corner_x><cart:upperleft_corner_y unit=\"km\">9</cart:upperleft_corner_y>"
         "</cart:Geo_Transformation></cart:Planar><cart:Geodetic_Model><cart:a_axis_radius unit=\"m\">3396190"
         "</cart:a_axis_radius><cart:c_axis_radius unit=\"m\">3376200</cart:c_axis_radius><cart:longitude_direction>"
         "Positive West</cart:longitude_direction></cart:Geodetic_Model></cart:Horizontal_Coordinate_System_Definition>"
         "</cart:Cartography></Discipline_Area></Observation_Area><File_Area_Observational><File><file_name>" +
         file + "</file_name></File><Array_2D_Image><offset unit=\"byte\">2</offset><Element_Array><data_type>" +
         options.type +
         "</data_type><unit>m</unit><scaling_factor>0.5</scaling_factor><value_offset>1000</value_offset></"
         "Element_Array>" +
         axes + "<Special_Constants>" + options.constants +
         "</Special_Constants></Array_2D_Image></File_Area_Observational></Product_Observational>\n";
}

}  // namespace isohf::test
