// SPDX-License-Identifier: BSD-3-Clause
#include "sim/terrain.h"

#include <algorithm>
#include <opencv2/imgcodecs.hpp>
#include <stdexcept>

namespace tld_follower::sim {

double Terrain::Height(double x, double y) const {
  const double across = (x / size.x() + 0.5) * (columns - 1);
  const double along = (y / size.y() + 0.5) * (rows - 1);
  if (!(across >= 0 && across <= columns - 1 && along >= 0 && along <= rows - 1)) return 0;
  const int column = std::min(int(across), columns - 2), row = std::min(int(along), rows - 2);
  const double u = across - column, v = along - row;
  const double south_east = Point(column + 1, row).z(), north_west = Point(column, row + 1).z();
  if (u + v <= 1) {
    const double south_west = Point(column, row).z();
    return south_west + u * (south_east - south_west) + v * (north_west - south_west);
  }
  const double north_east = Point(column + 1, row + 1).z();
  return north_east + (1 - u) * (north_west - north_east) + (1 - v) * (south_east - north_east);
}

Terrain LoadTerrain(const std::string& file, const btVector3& size) {
  const cv::Mat image = cv::imread(file, cv::IMREAD_GRAYSCALE | cv::IMREAD_ANYDEPTH);
  if (image.empty() || (image.depth() != CV_8U && image.depth() != CV_16U)) {
    throw std::runtime_error("the heightmap '" + file + "' is no grey image of 8 or 16 bits");
  }
  if (std::min(image.rows, image.cols) < 2 || std::max(image.rows, image.cols) > 1025) {
    throw std::runtime_error("the heightmap '" + file + "' must have 2 to 1025 rows and columns");
  }
  Terrain terrain;
  terrain.columns = image.cols;
  terrain.rows = image.rows;
  terrain.size = size;
  cv::Mat heights;
  image.convertTo(heights, CV_32F, size.z() / (image.depth() == CV_8U ? 255.0 : 65535.0));
  for (int row = image.rows - 1; row >= 0; --row) {
    terrain.heights.insert(terrain.heights.end(), heights.ptr<float>(row),
                           heights.ptr<float>(row) + image.cols);
  }
  return terrain;
}

}  // namespace tld_follower::sim
