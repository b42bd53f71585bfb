#include "data/core/camera.h"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/calib3d.hpp>
#include <utility>
#include <vector>

#include "data/core/error.h"

namespace slcmap {
namespace {

Camera EurocLeft() {
  Camera camera;
  camera.distortion = Distortion::kRadialTangential;
  camera.width_px = 752;
  camera.height_px = 480;
  camera.fx_px = 458.654;
  camera.fy_px = 457.296;
  camera.cx_px = 367.215;
  camera.cy_px = 248.375;
  camera.coefficients << -0.28340811, 0.07395907, 0.00019359, 1.76187114e-05;
  return camera;
}

Camera TumviLeft() {
  Camera camera;
  camera.distortion = Distortion::kEquidistant;
  camera.width_px = camera.height_px = 512;
  camera.fx_px = 190.978;
  camera.fy_px = 190.973;
  camera.cx_px = 254.932;
  camera.cy_px = 256.897;
  camera.coefficients << 0.0034823894, 0.0007150348, -0.0020532361, 0.0002029367;
  return camera;
}

Camera WithLens(Distortion lens, const Eigen::Vector2d& shape, double focal_px) {
  Camera camera = TumviLeft();
  camera.distortion = lens;
  camera.coefficients.setZero();
  camera.shape = shape;
  camera.fx_px = focal_px;
  camera.fy_px = 1.01 * focal_px;
  return camera;
}

// As OpenVINS' and Basalt's samples and ROS drivers have them.
Camera Omni() {
  Camera camera = WithLens(Distortion::kOmni, {1.6, 0}, 500);
  camera.coefficients << -0.1, 0.02, 1e-3, -5e-4;
  return camera;
}
Camera ExtendedUnified() { return WithLens(Distortion::kExtendedUnified, {0.63, 1.05}, 190); }
Camera DoubleSphere() { return WithLens(Distortion::kDoubleSphere, {-0.21, 0.59}, 157); }
Camera FieldOfView() { return WithLens(Distortion::kFieldOfView, {0.93, 0}, 260); }

Camera Rational() {
  Camera camera = EurocLeft();
  camera.coefficients << 0.8, -0.35, 2e-4, -3e-4;
  camera.higher_coefficients << -0.02, 1.1, -0.2, -0.05, 0, 0, 0, 0;
  return camera;
}

Camera PlumbBob() {
  Camera camera = EurocLeft();
  camera.higher_coefficients[0] = -0.01;
  return camera;
}

TEST(Camera, ProjectInvertsUnprojectUpToTheCorners) {
  for (const Camera& camera : {EurocLeft(), TumviLeft(), Omni(), ExtendedUnified(), DoubleSphere(),
                               FieldOfView(), Rational(), PlumbBob()}) {
    SCOPED_TRACE(static_cast<int>(camera.distortion));
    int seen = 0, all = 0;
    for (int y_px = 0; y_px < camera.height_px; y_px += 16) {
      for (int x_px = 0; x_px < camera.width_px; x_px += 16) {
        ++all;
        const auto ray = camera.Unproject({x_px, y_px});
        if (!ray) continue;  // outside its image circle
        EXPECT_NEAR(ray->norm(), 1, 1e-9);
        const auto back_px = camera.Project(*ray * 3.7);
        ASSERT_TRUE(back_px.has_value());
        EXPECT_LT((*back_px - Eigen::Vector2d(x_px, y_px)).norm(), 1e-6);
        ++seen;
      }
    }
    EXPECT_GT(seen, 0.7 * all);
    const bool is_euroc =
        camera.distortion == Distortion::kRadialTangential && camera.higher_coefficients.isZero();
    EXPECT_TRUE(seen == all || !is_euroc);
  }
}

// As calibrations of depth cameras and narrow lenses have them: large terms that nearly cancel.
Camera StrongRational() {
  Camera camera = EurocLeft();
  camera.coefficients << -4.9, 9.2, -6e-4, 1e-3;
  camera.higher_coefficients << -2.1, -4.6, 7.9, 0.4, 0, 0, 0, 0;
  return camera;
}

Camera ThinPrism() {
  Camera camera = Rational();
  camera.higher_coefficients.tail<4>() << 1e-3, -2e-4, -1e-3, 3e-4;
  return camera;
}

Camera StrongBarrel() {
  Camera camera = EurocLeft();
  camera.coefficients << -0.42, 0.12, 1e-3, -1e-3;
  camera.higher_coefficients[0] = -0.012;
  return camera;
}

Camera FoldingFisheye() {
  Camera camera = TumviLeft();
  camera.coefficients << 0, 0, -0.2, 0;
  return camera;
}

Camera WithShape(Camera camera, double a, double b) {
  camera.shape << a, b;
  return camera;
}

// Of all rays, each that a lens shows in its image is the only one of its pixel, and is found.
TEST(Camera, UnprojectFindsTheRayOfEveryPixelThatShowsOne) {
  for (const Camera& camera :
       {EurocLeft(), TumviLeft(), FoldingFisheye(), PlumbBob(), StrongBarrel(), Rational(),
        StrongRational(), ThinPrism(), Omni(), WithShape(Omni(), 0.7, 0), WithShape(Omni(), 1, 0),
        ExtendedUnified(), WithShape(ExtendedUnified(), 0.3, 2), DoubleSphere(),
        WithShape(DoubleSphere(), 0.4, 0.3), FieldOfView(), WithShape(FieldOfView(), 1.4, 0)}) {
    int seen = 0;
    for (double theta_rad = 0.01; theta_rad < 3.1; theta_rad += 0.01) {
      for (double phi_rad = 0; phi_rad < 6.2; phi_rad += 0.31) {
        const Eigen::Vector3d ray(std::sin(theta_rad) * std::cos(phi_rad),
                                  std::sin(theta_rad) * std::sin(phi_rad), std::cos(theta_rad));
        const auto px = camera.Project(ray);
        if (!px || !camera.Contains(*px)) continue;
        ++seen;
        const auto found = camera.Unproject(*px);
        ASSERT_TRUE(found) << static_cast<int>(camera.distortion) << " " << theta_rad;
        // Where a lens nearly folds, a pixel hardly tells the ray.
        EXPECT_LT((*found - ray).norm(), 1e-4) << static_cast<int>(camera.distortion);
        const auto again_px = camera.Project(*found);
        ASSERT_TRUE(again_px);
        EXPECT_LT((*again_px - *px).norm(), 1e-6);
      }
    }
    EXPECT_GT(seen, 400) << static_cast<int>(camera.distortion);
  }
}

// Radially 1 + 0.8 s - ... over 1 + 1.1 s - ...: its derivative has a zero at the radius 1.0938.
TEST(Camera, AQuotientFoldsToo) {
  Camera camera = Rational();
  camera.coefficients.tail<2>().setZero();
  const auto radius = [&](double r) { return camera.Project({r, 0, 1}); };
  double folds = 0;
  for (double r = 0; r < 3; r += 1e-3) {
    if (radius(r)) folds = r;
  }
  const auto at = [&](double r) {
    const double s = r * r;
    return r * (1 + s * (0.8 + s * (-0.35 - 0.02 * s))) / (1 + s * (1.1 + s * (-0.2 - 0.05 * s)));
  };
  EXPECT_GT(at(folds), at(folds - 2e-3));
  EXPECT_LT(at(folds + 4e-3), at(folds + 2e-3));
  for (double r = folds + 2e-3; r < 30; r *= 1.1) EXPECT_FALSE(radius(r)) << r;
}

// Beyond where the distorted angle falls it rises again for k4 > 0: no pixel is seen from there.
TEST(Camera, AFisheyeThatRisesAgainIsNotSeen) {
  Camera camera = TumviLeft();
  camera.coefficients << -0.3, 0, 0, 0.005;
  const auto project = [&](double theta_rad) {
    return camera.Project({std::sin(theta_rad), 0, std::cos(theta_rad)});
  };
  EXPECT_TRUE(project(1.0));
  for (double theta_rad = 1.2; theta_rad < 3.1; theta_rad += 0.1) {
    EXPECT_FALSE(project(theta_rad)) << theta_rad;
  }
  for (double x_px = 300; x_px < 512; x_px += 5) {
    const auto ray = camera.Unproject({x_px, camera.cy_px});
    if (ray) {
      EXPECT_LT(std::atan2(ray->head<2>().norm(), ray->z()), 1.2);
    }
  }
}

// Pixels by OpenCV 4.6's cv::omnidir::projectPoints.
TEST(Camera, OmniAsInOpenCv) {
  const std::vector<Eigen::Vector3d> points = {
      {0.3, 0.2, 1}, {-0.9, 0.4, 0.5}, {1.0, -0.7, 0.1}, {1.2, 0.3, -0.2}};
  const std::pair<double, std::vector<Eigen::Vector2d>> kByOpenCv[] = {
      {1.6,
       {{310.369593798, 294.236979820},
        {59.862263627, 344.535754048},
        {489.399577981, 91.243722205},
        {573.003268394, 337.476853089}}},
      {0.8,
       {{335.684496588, 311.295912170},
        {-56.017083264, 396.677600552},
        {672.583665732, -37.963251151},
        {908.296854846, 423.221696826}}}};
  for (const auto& [xi, expected_px] : kByOpenCv) {
    const Camera camera = WithShape(Omni(), xi, 0);
    for (size_t i = 0; i < points.size(); ++i) {
      const auto px = camera.Project(points[i]);
      ASSERT_TRUE(px);
      EXPECT_LT((*px - expected_px[i]).norm(), 1e-8) << xi << " " << i;
    }
  }
}

// What no lens sees: the other half of the sphere falls onto the same pixels.
TEST(Camera, NoLensSeesBehindItselfButAFisheyeBesideItself) {
  for (const Camera& camera : {Omni(), ExtendedUnified(), DoubleSphere(), FieldOfView()}) {
    EXPECT_FALSE(camera.Project({0.1, 0, -1}).has_value()) << static_cast<int>(camera.distortion);
  }
  EXPECT_TRUE(TumviLeft().Project(Eigen::Vector3d(1, 0, -0.05)).has_value());
  EXPECT_FALSE(EurocLeft().Project(Eigen::Vector3d(1, 0, -0.05)).has_value());
}

TEST(Camera, PointsFarOutsideTheViewDoNotFoldBackIntoIt) {
  Camera lens = EurocLeft();
  lens.coefficients << -0.3, 0.03, 0, 0;  // turns back at a radius of 1.2, and again further out
  EXPECT_TRUE(lens.Project({1.0, 0, 1}).has_value());
  for (const double x : {1.6, 2.0, 3.0, 5.0}) EXPECT_FALSE(lens.Project({x, 0, 1})) << x;
  // The derivative 1 - 1.4 theta^6 of the distorted angle is zero at 0.945 rad.
  const Camera fisheye = FoldingFisheye();
  for (const auto& [theta_rad, is_seen] : {std::pair{0.935, true}, {0.955, false}, {1.5, false}}) {
    EXPECT_EQ(fisheye.Project({std::sin(theta_rad), 0, std::cos(theta_rad)}).has_value(), is_seen);
  }
}

TEST(Camera, CheckNamesWhatIsAbsurd) {
  for (const Camera& camera : {EurocLeft(), Omni(), ExtendedUnified(), DoubleSphere(),
                               FieldOfView(), Rational(), PlumbBob()}) {
    EXPECT_NO_THROW(camera.Check("camera"));
  }
  Camera short_focus = EurocLeft(), off_centre = EurocLeft();
  short_focus.fx_px = 4.58;
  off_centre.cx_px = 3672;
  EXPECT_THROW(short_focus.Check("cam0"), DataError);
  EXPECT_THROW(off_centre.Check("cam0"), DataError);
}

TEST(Camera, AgreesWithOpenCv) {
  Camera tangential = EurocLeft();
  tangential.coefficients.tail<2>() << 0.01, -0.02;
  std::vector<cv::Point3d> points;
  for (double x = -1; x < 1.2; x += 0.5) {
    for (double y = -0.8; y < 1; y += 0.4) points.emplace_back(x, y, 2);
  }
  const cv::Vec3d zero;
  for (const Camera& camera : {tangential, TumviLeft(), PlumbBob(), Rational(), ThinPrism()}) {
    std::vector<double> k(camera.coefficients.begin(), camera.coefficients.end());
    const cv::Matx33d K(camera.fx_px, 0, camera.cx_px, 0, camera.fy_px, camera.cy_px, 0, 0, 1);
    std::vector<cv::Point2d> expected_px;
    if (camera.distortion == Distortion::kEquidistant) {
      cv::fisheye::projectPoints(points, expected_px, zero, zero, K, k);
    } else {
      k.insert(k.end(), camera.higher_coefficients.begin(), camera.higher_coefficients.end());
      cv::projectPoints(points, zero, zero, K, k, expected_px);
    }
    for (size_t i = 0; i < points.size(); ++i) {
      const auto px = camera.Project({points[i].x, points[i].y, points[i].z});
      ASSERT_TRUE(px.has_value());
      EXPECT_NEAR(px->x(), expected_px[i].x, 1e-9);
      EXPECT_NEAR(px->y(), expected_px[i].y, 1e-9);
    }
  }
}

// Numbers computed by hand from the papers' formulas, of the point (3, 0, 4): |p| = 5.
TEST(Camera, LensesAsTheirPapersSay) {
  const Eigen::Vector3d p(3, 0, 4);
  const auto plane_x = [&](const Camera& camera) {
    return (camera.Project(p)->x() - camera.cx_px) / camera.fx_px;
  };
  // 3 / (0.5 sqrt(2 * 9 + 16) + 0.5 * 4)
  EXPECT_NEAR(plane_x(WithLens(Distortion::kExtendedUnified, {0.5, 2}, 200)), 0.61031730, 1e-8);
  // z = 0.2 * 5 + 4 = 5; 3 / (0.5 sqrt(34) + 0.5 * 5)
  EXPECT_NEAR(plane_x(WithLens(Distortion::kDoubleSphere, {0.2, 0.5}, 200)), 0.55396793, 1e-8);
  // atan(2 * 0.75 tan(0.5)) / 1
  EXPECT_NEAR(plane_x(WithLens(Distortion::kFieldOfView, {1, 0}, 200)), 0.68649093, 1e-8);
}

}  // namespace
}  // namespace slcmap
