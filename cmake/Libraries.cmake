# Libraries of other people (docs/dependencies.md says why each).
set(CMAKE_FIND_PACKAGE_TARGETS_GLOBAL ON)  # a project that adds this one as a folder links them, too

find_package(Eigen3 3.4 REQUIRED NO_MODULE)
find_package(TBB REQUIRED)
find_package(yaml-cpp REQUIRED)
find_package(TinyGLTF REQUIRED)
find_package(fmt REQUIRED)
find_package(PkgConfig REQUIRED)
pkg_check_modules(libzip REQUIRED IMPORTED_TARGET GLOBAL libzip)  # its CMake config wants command line tools, too
find_package(draco REQUIRED)
find_package(meshoptimizer REQUIRED)
find_package(hwy REQUIRED)
find_package(muparser REQUIRED)
find_package(embree 3 REQUIRED)
find_package(nlohmann_json REQUIRED)
if(KPSA_PROGRAM)
  find_package(CLI11 REQUIRED)
  pkg_check_modules(httplib REQUIRED IMPORTED_TARGET GLOBAL cpp-httplib)
  find_package(ZLIB REQUIRED)
  find_package(PNG REQUIRED)
  find_package(JPEG REQUIRED)
  find_package(GTest REQUIRED)
endif()
