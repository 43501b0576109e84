package android.content;

import android.content.res.AssetManager;
import java.io.File;

/** As much of Android's class as the Kotlin face and the demo use, for the host's tests; its assets are files of a folder. */
public class Context {
    private final File folder;

    public Context() {
        this(new File("."));
    }

    public Context(File folder) {
        this.folder = folder;
    }

    public File getCacheDir() {
        return new File(System.getProperty("java.io.tmpdir"));
    }

    public File getFilesDir() {
        return getCacheDir();
    }

    public File getExternalFilesDir(String kind) {
        return getCacheDir();
    }

    public AssetManager getAssets() {
        return new AssetManager(folder);
    }

    public <T> T getSystemService(Class<T> service) {
        throw new UnsupportedOperationException();
    }

    public void startActivity(Intent intent) {}
}
