# The rooms up to host/ as one library: kpsa::kpsa, which is kpsa::static or, with BUILD_SHARED_LIBS, kpsa::shared. What
# is installed with it: the public face (include/kpsa), the headers that plugins include (include/kpsa/plugin), and a
# package for find_package(kpsa).
include(CMakePackageConfigHelpers)
include(GNUInstallDirs)

set(objects "")
foreach(room base graph nodes files gltf rig kpsa training host)
  list(APPEND objects $<TARGET_OBJECTS:kpsa_${room}>)
endforeach()
foreach(kind static shared)
  string(TOUPPER ${kind} type)
  add_library(kpsa_${kind} ${type} EXCLUDE_FROM_ALL ${objects})
  set_target_properties(kpsa_${kind} PROPERTIES OUTPUT_NAME kpsa EXPORT_NAME ${kind} LINKER_LANGUAGE CXX)
  target_compile_features(kpsa_${kind} PUBLIC cxx_std_20)
  target_include_directories(kpsa_${kind} PUBLIC $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/include> $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
  target_link_libraries(kpsa_${kind} PRIVATE fmt::fmt hwy::hwy TBB::tbb embree muparser::muparser yaml-cpp TinyGLTF::TinyGLTF
                        meshoptimizer::meshoptimizer PkgConfig::libzip ${CMAKE_DL_LIBS} $<BUILD_INTERFACE:kpsa_draco>
                        $<BUILD_INTERFACE:kpsa_settings>)
endforeach()
target_link_libraries(kpsa_static PRIVATE $<INSTALL_INTERFACE:kpsa::draco>)  # a shared one has it within
set_target_properties(kpsa_shared PROPERTIES VERSION ${PROJECT_VERSION} SOVERSION ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR})
if(BUILD_SHARED_LIBS)
  add_library(kpsa::kpsa ALIAS kpsa_shared)
else()
  add_library(kpsa::kpsa ALIAS kpsa_static)
endif()

# Headers that plugins include: those of base/ and graph/
add_library(kpsa_plugin INTERFACE)
add_library(kpsa::plugin ALIAS kpsa_plugin)
set_target_properties(kpsa_plugin PROPERTIES EXPORT_NAME plugin)
target_compile_features(kpsa_plugin INTERFACE cxx_std_20)
target_include_directories(kpsa_plugin INTERFACE $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}> $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}/kpsa/plugin>)

if(NOT PROJECT_IS_TOP_LEVEL)
  return()
endif()
set_target_properties(kpsa_static kpsa_shared PROPERTIES EXCLUDE_FROM_ALL OFF)
set(package ${CMAKE_INSTALL_LIBDIR}/cmake/kpsa)
install(TARGETS kpsa_static kpsa_shared kpsa_plugin EXPORT kpsaTargets)
install(EXPORT kpsaTargets NAMESPACE kpsa:: DESTINATION ${package})
install(DIRECTORY include/kpsa DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
install(DIRECTORY base graph DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/kpsa/plugin FILES_MATCHING PATTERN "*.h")
get_target_property(draco kpsa_draco IMPORTED_LOCATION)
install(FILES ${draco} DESTINATION ${CMAKE_INSTALL_LIBDIR} RENAME libkpsa_draco.a)
configure_package_config_file(cmake/kpsaConfig.cmake.in ${PROJECT_BINARY_DIR}/kpsaConfig.cmake INSTALL_DESTINATION ${package} PATH_VARS CMAKE_INSTALL_LIBDIR)
write_basic_package_version_file(${PROJECT_BINARY_DIR}/kpsaConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/kpsaConfig.cmake ${PROJECT_BINARY_DIR}/kpsaConfigVersion.cmake DESTINATION ${package})
if(KPSA_PROGRAM)
  install(TARGETS kpsa)
endif()
install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR})
