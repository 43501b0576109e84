// Demo and benchmark. Running it needs an SDK and a device; ../check.sh compiles it against stand-ins.
plugins {
    alias(libs.plugins.android.application)
}

android {
    namespace = "dev.foresound.demo"
    compileSdk = libs.versions.compileSdk.get().toInt()
    defaultConfig {
        applicationId = "dev.foresound.demo"
        minSdk = libs.versions.minSdk.get().toInt()
        targetSdk = libs.versions.compileSdk.get().toInt()
        versionCode = 1
        versionName = "0.1.0"
    }
    buildTypes {
        release {
            isMinifyEnabled = true
            signingConfig = signingConfigs.getByName("debug")
        }
    }
    // The repository's own scenes and voices, and the paper's figures.
    sourceSets.getByName("main").assets.srcDirs(
        rootDir.parentFile.resolve("assets/scenes"),
        rootDir.parentFile.resolve("assets/speech"),
        rootDir.parentFile.resolve("assets/paper"),
    )
    compileOptions {
        sourceCompatibility = JavaVersion.VERSION_17
        targetCompatibility = JavaVersion.VERSION_17
    }
}

dependencies {
    implementation(project(":foresound"))
    implementation(libs.coroutines.android)
}
